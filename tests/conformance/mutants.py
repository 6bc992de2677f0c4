"""How many broken devices the suite notices: `python -m tests.conformance.mutants [NAME ...]`.

Each mutant breaks one sentence of the standard in our own node; the suite is run on it in
lock-step and stops at the first case that fails. What is printed: the score, and each mutant that
nobody has noticed. `--verbose` names the case that noticed each of the others, `--write` keeps them
in `noticed.json`, by which the tests need to run no other case.
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
"""The first case that notices each mutant; "" where none does."""

CRASHES = ("AttributeError", "TypeError", "KeyError", "NameError", "IndexError", "struct.error")
"""How a device ends that is not broken as intended: a case that fails of these proves nothing."""


class Notice(NamedTuple):
    """What came of a mutant.

    Attributes:
        mutant: its name.
        case: the first case that failed, "" if none did.
        remark: how it failed.
        seconds: how long the run took.

    """

    mutant: str
    case: str
    remark: str
    seconds: float


def notice(name: str, case: str = "") -> Notice:
    """Run the suite, or one case, on a mutant, "" for the sound device, until a case fails."""
    begin = time.monotonic()
    settings = own_channel()
    with (
        tempfile.TemporaryDirectory() as folder,
        pytest.MonkeyPatch.context() as patch,
        redirect_stdout(io.StringIO()),
        redirect_stderr(io.StringIO()),
        Bus(settings) as own,
        Bus(settings) as peer,
    ):
        eds = every_service(Path(folder))
        if name:
            MUTANTS[name].apply(patch)
        step = stepper(make_node(eds, NODE), own)
        results = run_in_lock_step(peer, step, NODE, eds, {case} if case else None, first=True)
    failed = [case for case, outcome in results.outcomes.items() if outcome == "failed"]
    remark = results.remarks[-1] if failed else ""
    return Notice(name, failed[0] if failed else "", remark, time.monotonic() - begin)


def crashed(found: Notice) -> bool:
    """Tell whether the device broke down rather than misbehaved."""
    return any(error in found.remark for error in CRASHES)


def notices(names: Sequence[str]) -> list[Notice]:
    """Run the suite on many mutants, two at a time."""
    with get_context("spawn").Pool(PROCESSES) as pool:
        return pool.map(notice, names, chunksize=1)


def main() -> None:
    """Print the score."""
    verbose = "--verbose" in sys.argv
    names = [word for word in sys.argv[1:] if not word.startswith("-")] or list(MUTANTS)
    found = notices(names)
    for one in found:
        if verbose or not one.case or crashed(one):
            how = "CRASHED " if crashed(one) else ""
            said = next((x[1:].strip() for x in one.remark.splitlines() if x[:2] == "E "), "")
            print(f"{one.case or '-':>6} {one.seconds:5.1f} s  {one.mutant}: {how}{said[:90]}")
            if not one.case:
                print(f"{'':>16}{MUTANTS[one.mutant].sentence}")
    if "--write" in sys.argv:
        NOTICED.write_text(json.dumps({one.mutant: one.case for one in found}, indent=1) + "\n")
    count = sum(bool(one.case) and not crashed(one) for one in found)
    print(f"{count} of {len(found)} mutants noticed, {100 * count / len(found):.1f} %")


if __name__ == "__main__":
    main()
