"""The page that leads from a log to a name, held against a log that is identified."""

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import hil_emulator
from hil_emulator.api import identification
from hil_emulator.api.actuator import ActuatorModel
from hil_emulator.identify.measured.experiment import UNITS, Experiment
from hil_emulator.identify.session import Question
from hil_emulator.platform.output_files import write_texts
from tests.identify.rig_data import KNEE, knee, recorded

ROOM = Path(hil_emulator.__file__).parent / "identify"
PAGE = (Path(__file__).parents[2] / "docs" / "walk.md").read_text()
SECTIONS = {part.partition("\n")[0]: part for part in PAGE.split("\n## ")}

WALK = re.findall(r"^\| \d+ \| `([\w/.]+)`", SECTIONS["The walk"], re.M)
"""The files that a reader is led through, in order."""

SELECTION = re.findall(r"`(\w+\.py)`", SECTIONS["Who decides"])
"""The files of `selection/`, by what is asked of them."""

MOST = 25
"""Files that a newcomer reads to the end."""

MOST_OF_SELECTION = 12
"""Files in which a newcomer finds who decides."""

HIDDEN = {"hysteresis_width": 2e-4}
ASKED = Question(only=["hysteresis", "internal_leakage"])
"""Two candidates are as many as a search needs to compare them."""


def written(folder: Path, e: Experiment) -> Path:
    """Write an experiment as a user's logger does."""
    columns = {"time [s]": np.arange(e.samples) * e.period, "valve_current [A]": e.current}
    columns |= {f"{name} [{UNITS[name]}]": values for name, values in e.readings.items()}
    file = folder / f"{e.name}.csv"
    table = np.column_stack(list(columns.values()))
    np.savetxt(file, table, delimiter=",", header=",".join(columns), comments="")
    return file


def entered(run: Callable[[], object]) -> list[str]:
    """Return the files of `identify` of which a function was called, the first one first."""
    order: dict[str, None] = {}

    def called(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        # what has no name of its own, such as a default that is made, is no place to read
        if event == "call" and not code.co_name.startswith("<"):
            order.setdefault(code.co_filename)

    before = sys.getprofile()
    sys.setprofile(called)
    try:
        run()
    finally:
        sys.setprofile(before)
    files = [Path(name) for name in order]
    return [str(f.relative_to(ROOM)) for f in files if f.is_relative_to(ROOM)]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], dict[str, Any]]:
    """Identify logs as the command does; return the files that were entered, and result.json."""
    folder = tmp_path_factory.mktemp("walk")
    drives = [("multisine", 1), ("steps", 2), ("multisine", 101)]
    *logs, held = (written(folder, recorded(HIDDEN, *drive, duration=1.0)) for drive in drives)

    def identify() -> None:
        identified = identification.examined(ActuatorModel("knee", knee()), logs, [held], ASKED)
        texts = identification.findings(identified.result, [KNEE])
        write_texts({folder / name: text for name, text in texts.items()})

    files = entered(identify)
    return files, json.loads((folder / "result.json").read_text())


def test_the_walk_is_short() -> None:
    """The walk names existing files, each once, and few."""
    assert all((ROOM / file).is_file() for file in WALK)
    assert 0 < len(set(WALK)) == len(WALK) <= MOST


@pytest.mark.slow
def test_the_walk_is_in_the_order_of_a_run(run: tuple[list[str], dict[str, Any]]) -> None:
    """A log that is identified passes each of its files, first entered in that order."""
    files, _ = run
    assert [file for file in files if file in WALK] == WALK


@pytest.mark.slow
def test_the_walk_ends_with_the_result(run: tuple[list[str], dict[str, Any]]) -> None:
    """The hidden effect is named, and the last file of the walk holds the result."""
    files, result = run
    assert [effect["name"] for effect in result["effects"]] == ["hysteresis"]
    beside_pictures = [file for file in files if not file.startswith("reporting/")]
    assert beside_pictures[-1] == WALK[-1] == "conclusion/result.py"


def test_whatever_else_runs_is_of_a_folder_on_the_page(
    run: tuple[list[str], dict[str, Any]],
) -> None:
    """Each file that takes part in a run stands on the page, or in a folder that does."""
    files, _ = run
    others = set(re.findall(r"`([\w/]+(?:\.py|/))`", SECTIONS["The other files"]))
    listed = {*WALK, *others, *(f"selection/{file}" for file in SELECTION)}
    assert [f for f in files if not listed & {f, *(f"{p}/" for p in Path(f).parents)}] == []


def test_each_folder_of_the_page_is_there() -> None:
    """A folder that the page describes exists, and every folder but `selection` is described."""
    described = set(re.findall(r"^\| `(\w+)/`", SECTIONS["The other files"], re.M))
    there = {f.parent.name for f in ROOM.glob("*/__init__.py")}
    assert described == there - {"selection"}


def test_the_walk_describes_every_file_of_selection() -> None:
    """The list of proposing, comparing and deciding has each file once, and few files."""
    files = [f.name for f in (ROOM / "selection").glob("*.py") if f.name != "__init__.py"]
    assert sorted(SELECTION) == sorted(files)
    assert len(files) <= MOST_OF_SELECTION
