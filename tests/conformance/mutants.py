"""Mutation score of the suite: `python -m tests.conformance.mutants [NAME ...]`.

Each mutant violates one sentence of the standard in the emulated node; the suite is run on it in
lock-step and stops at the first case that fails. The output is the score, and each mutant that no
case detects. `--verbose` names the detecting case of the others, and `--write` stores these cases
in `noticed.json`, so that the tests run only them.
"""

import io
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import pytest

sys.path.append(str(Path(__file__).parent))

from constant_node import make_node, stepper
from every_service import every_service
from mutations import MUTANTS
from suite import own_channel, run_in_lock_step

from hil_emulator.bus.bus import Bus

NODE = 5
PROCESSES = 2
NOTICED = Path(__file__).with_name("noticed.json")
"""The first case that detects each mutant; "" if no case detects it."""

CRASHES = ("AttributeError", "TypeError", "KeyError", "NameError", "IndexError", "struct.error")
"""Errors of a device that crashes; a failure for these is not a detection."""


class Notice(NamedTuple):
    """The result of a mutant.

    Attributes:
        mutant: its name.
        case: the first case that failed, "" if all passed.
        remark: message of the failure.
        seconds: duration of the run.

    """

    mutant: str
    case: str
    remark: str
    seconds: float


def notice(name: str, case: str = "") -> Notice:
    """Run the suite, or one case, on a mutant ("" for the correct device) until a case fails."""
    begin = time.monotonic()
    settings = own_channel()
    with (
        tempfile.TemporaryDirectory() as folder,
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(io.StringIO()),
        redirect_stderr(io.StringIO()),
        Bus(settings) as port,
        Bus(settings) as peer,
    ):
        eds = every_service(Path(folder))
        if name:
            MUTANTS[name].apply(patch)
        step = stepper(make_node(eds, NODE), port)
        results = run_in_lock_step(peer, step, NODE, eds, {case} if case else None, first=True)
    failed = [case for case, outcome in results.outcomes.items() if outcome == "failed"]
    remark = results.remarks[-1] if failed else ""
    return Notice(name, failed[0] if failed else "", remark, time.monotonic() - begin)


def crashed(result: Notice) -> bool:
    """Return whether the device crashed instead of violating the standard."""
    return any(error in result.remark for error in CRASHES)


def notices(names: Sequence[str]) -> list[Notice]:
    """Run the suite on many mutants, two at a time."""
    with get_context("spawn").Pool(PROCESSES) as pool:
        return pool.map(notice, names, chunksize=1)


def main() -> None:
    """Print the score."""
    verbose = "--verbose" in sys.argv
    names = [word for word in sys.argv[1:] if not word.startswith("-")] or list(MUTANTS)
    results = notices(names)
    for result in results:
        if verbose or not result.case or crashed(result):
            how = "CRASHED " if crashed(result) else ""
            reason = next((x[1:].strip() for x in result.remark.splitlines() if x[:2] == "E "), "")
            print(
                f"{result.case or '-':>6} {result.seconds:5.1f} s  {result.mutant}: "
                f"{how}{reason[:90]}"
            )
            if not result.case:
                print(f"{'':>16}{MUTANTS[result.mutant].sentence}")
    if "--write" in sys.argv:
        NOTICED.write_text(
            json.dumps({result.mutant: result.case for result in results}, indent=1) + "\n"
        )
    count = sum(bool(result.case) and not crashed(result) for result in results)
    print(f"{count} of {len(results)} mutants detected, {100 * count / len(results):.1f} %")


if __name__ == "__main__":
    main()
