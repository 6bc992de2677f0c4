"""The process that plays a scenario for the panel, on its own emulator in real time.

It prints one line of JSON at a time: its progress, and which expectations are met, missed or open.
"""

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.scenario import schema
from hil_emulator.scenario.judge import judge
from hil_emulator.scenario.outcome import Check
from hil_emulator.scenario.perform import Conductor, rig_of
from hil_emulator.scenario.schema import Expect
from hil_emulator.simulation.emulator import Emulator

_SLICE_S = 0.1  # emulator time between two lines (assumed)


def play(file: Path) -> Iterator[dict[str, Any]]:
    """Play a scenario; yield its progress.

    Raises:
        UserError: for a file that cannot be played.

    """
    scenario = schema.load(file)
    with Emulator(rig_of(scenario, file.parent)) as emulator:
        conductor = Conductor(emulator, scenario, file.parent)
        begin, now = time.monotonic(), 0.0
        while now < scenario.duration:
            now = min(now + _SLICE_S, scenario.duration)
            conductor.play(now)
            checks = judge(scenario.expectations, emulator.recorder)
            over = now >= scenario.duration
            yield {
                "title": scenario.title, "time": now, "duration": scenario.duration,
                "checks": [
                    {"text": c.text, "found": c.observed, "state": state(e, c, now, over=over)}
                    for e, c in zip(scenario.expectations, checks, strict=True)
                ],
            }  # fmt: skip
            time.sleep(max(0.0, begin + now - time.monotonic()))
        conductor.close()


def state(e: Expect, check: Check, now: float, *, over: bool) -> str:
    """Return the final state of a check at a time [s]: "met", "missed" or "open"."""
    if e.signal is None:  # a frame that was seen stays seen
        settled = check.passed is e.seen or (e.until is not None and now >= e.until)
    elif e.by is not None:
        held = check.passed and e.lasting is not None
        settled = held or (not check.passed and now >= e.by + (e.lasting or 0.0))
    elif check.passed:
        settled = e.until is not None and now >= e.until
    else:  # it has left its band, unless its time has not come
        settled = now > e.start
    if not (settled or over):
        return "open"
    return "met" if check.passed else "missed"


def main() -> None:
    """Play the file of the first argument."""
    try:
        for line in play(Path(sys.argv[1])):
            print(json.dumps(line), flush=True)
    except UserError as error:
        print(json.dumps({"trouble": str(error)}), flush=True)


if __name__ == "__main__":
    main()
