"""The process that plays a scenario for the panel, on its own emulator in real time.

It prints one line of JSON at a time: its progress, and which expectations are met, missed or open.
"""

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hil_emulator.bus.bus import Bus
from hil_emulator.errors import UserError
from hil_emulator.platform.packaged import packaged
from hil_emulator.platform.paths import near
from hil_emulator.recording.several import Recorders
from hil_emulator.scenario import loading
from hil_emulator.scenario.perform import rig_of
from hil_emulator.scenario.performance import Performance
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.units import axis

_SLICE_S = 0.1  # emulator time between two lines (assumed)

_EXTERNAL = (
    "scenario {file}: it is for your controller on the bus; end this run, and "
    "`hil-emulator run --scenario {file} --panel` waits for the controller and shows the run"
)


def play(file: Path) -> Iterator[dict[str, Any]]:
    """Play a scenario; yield its progress.

    Raises:
        UserError: for a file that cannot be played, or that is for a controller on a bus, which
            this emulator of the panel is not on.

    """
    scenario = loading.load(file)
    if scenario.controller == "external":
        name = file.stem if packaged().get(file.stem) == file else near(file)
        raise UserError(_EXTERNAL.format(file=name))
    config = rig_of(scenario, file.parent)
    with axis(rotary=config.rotary), Emulator(config) as emulator, Bus(emulator.bus) as port:
        performance = Performance(file, scenario, emulator.rig, port, scenario.controller)
        emulator.rig.recorder = Recorders(*performance.recorders)
        conductor, begin = performance.conductor, time.monotonic()
        while not conductor.over:
            until = conductor.now + _SLICE_S
            while conductor.now < until and not conductor.over:
                conductor.before()
                emulator.tick()
                conductor.after()
            if conductor.over:
                performance.judge.end()
            yield {
                "title": scenario.title, "time": conductor.now, "duration": scenario.duration,
                "checks": [
                    {"text": c.text, "found": c.observed, "state": c.state}
                    for c in performance.judge.checks
                ],
            }  # fmt: skip
            time.sleep(max(0.0, begin + conductor.now - time.monotonic()))


def main() -> None:
    """Play the file of the first argument."""
    try:
        for line in play(Path(sys.argv[1])):
            print(json.dumps(line), flush=True)
    except UserError as error:
        print(json.dumps({"trouble": str(error)}), flush=True)


if __name__ == "__main__":
    main()
