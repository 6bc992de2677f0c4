"""What is over, on the panel's page: the same values, by log."""

import asyncio
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect

from hil_emulator.config.load import load_rig
from hil_emulator.errors import UserError
from hil_emulator.panel.offline_source import opened
from hil_emulator.panel.result_folder import RESULT, TRACES
from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal
from hil_emulator.recording.journal import Recording
from hil_emulator.simulation.emulator import Emulator
from tests.panel.bench import PATIENCE_S, Page


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Return a fifth of a second with a fault in it."""
    with Emulator(load_rig([shipped("configs/hyq_knee.toml")])) as emulator:
        emulator.run_for("0.1 s")
        emulator.fault("pressure_a", "stuck")
        emulator.fault("pressure_b", "off", start="50 ms")
        emulator.run_for("0.1 s")
        return emulator.recording()


def test_a_recording_shows_its_rows_and_what_was_done(recording: Recording, tmp_path: Path) -> None:
    """Row for row, with the machine that its header describes; a fault where it begins."""
    file = tmp_path / "run.rec"
    journal.write(recording, file)
    source = opened(file)
    marks = [(time, words) for _, time, words in source.state.events]
    assert marks == [(0.1, "pressure_a stuck"), (pytest.approx(0.15), "pressure_b off")]
    assert source.hello["machine"]["stroke"] == pytest.approx(0.08)
    row = source.state.row(0.15)
    np.testing.assert_array_equal(np.float32(row), recording.rows[150].astype(np.float32))


def write_found(folder: Path) -> None:
    """Write what `identify --out` does: two logs of one channel."""
    time, measured = np.arange(50) * 0.01, np.linspace(0.0, 1.0, 50)
    parts = {"time": time, "measured": measured, "noise": np.ones(1), "before": measured / 2,
             "after": measured / 4, "free_before": np.full(50, np.nan),
             "free_after": np.full(50, np.nan)}  # fmt: skip
    logs = {f"{log}/load_force|{p}": v for log in ("a.csv", "b.csv") for p, v in parts.items()}
    np.savez(folder / TRACES, **logs)
    result = {"verdict": "agrees", "reason": "", "effects": [], "gap": {}, "gap_measure": "N"}
    (folder / RESULT).write_text(json.dumps(result))


def test_an_identification_shows_both_models_by_log(tmp_path: Path) -> None:
    """The prediction is the measurement minus the error; free runs are shown if present."""
    write_found(tmp_path)
    source = opened(tmp_path)
    assert list(source.logs) == ["a.csv", "b.csv"]
    columns = list(source.state.columns)
    row = dict(zip(columns, source.state.row(0.49), strict=True))
    assert row == pytest.approx(
        {"time": 0.49, "load_force": 1.0, "load_force.configured": 0.5, "load_force.found": 0.75}
    )


@pytest.mark.parametrize("content", [
    "", "[]", "{}", "null", '{"verdict": "agrees"', "[" * 100_000, "\ud800",
    '{"verdict": "", "reason": "", "gap_measure": "", "gap": {}, "effects": [[]]}',
    '{"verdict": "", "reason": "", "gap_measure": "", "gap": {"x": 1}, "effects": []}',
    '{"verdict": 1, "reason": "", "gap_measure": "", "gap": {}, "effects": []}',
])  # fmt: skip
def test_a_damaged_result_is_refused_in_words(tmp_path: Path, content: str) -> None:
    """Cut, empty, of another shape or nested beyond measure: one message that names the file."""
    write_found(tmp_path)
    (tmp_path / RESULT).write_text(content, errors="replace")
    with pytest.raises(UserError, match=r"result\.json: not the result of an identification"):
        opened(tmp_path)


def _cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-200])


def _empty(file: Path) -> None:
    file.write_bytes(b"")


def _changed(file: Path, change: Callable[[dict[str, np.ndarray]], object]) -> None:
    arrays = dict(np.load(file))
    change(arrays)
    np.savez(file, **arrays)


def _clocked(file: Path, time: np.ndarray) -> None:
    _changed(file, lambda a: a.update({f"{log}.csv/load_force|time": time for log in "ab"}))


DAMAGES: dict[str, Callable[[Path], None]] = {
    "cut": _cut,
    "empty": _empty,
    "missing": lambda file: file.unlink(),
    "a part is missing": lambda file: _changed(file, lambda a: a.pop("a.csv/load_force|after")),
    "texts": lambda file: _changed(file, lambda a: a.update({"a.csv/x|time": np.array(["x"])})),
    "another length": lambda file: _changed(
        file, lambda a: a.update({"a.csv/load_force|time": np.arange(7) * 0.1})
    ),
    "no clock": lambda file: _clocked(file, np.full(50, np.nan)),
    "a clock of nanoseconds": lambda file: _clocked(file, np.arange(50) * 1e-9),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_traces_are_refused_in_words(tmp_path: Path, damage: str) -> None:
    """Whatever is wrong with the archive or its arrays."""
    write_found(tmp_path)
    DAMAGES[damage](tmp_path / TRACES)
    with pytest.raises(UserError, match=r"traces\.npz: not the traces of an identification"):
        opened(tmp_path)


@pytest.mark.parametrize("name", ["run.csv", "nothing.rec", "."])
def test_what_is_neither_is_refused_in_words(tmp_path: Path, name: str) -> None:
    """With the way out."""
    with pytest.raises(UserError, match=r"name a recording|cannot be read|identify --out"):
        opened(tmp_path / name)


def test_the_command_serves_a_page_that_cannot_touch(recording: Recording, tmp_path: Path) -> None:
    """Its stream has the same door as that of a live bench."""
    file = tmp_path / "run.rec"
    journal.write(recording, file)
    command = [sys.executable, "-m", "hil_emulator", "panel", str(file)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    place, token = re.findall(r"http://(\S+)/#(\S+)", process.stdout.readline())[0]

    async def look() -> None:
        async with connect(f"ws://{place}/stream?token={token}", max_size=None) as connection:
            page = Page(connection)
            assert (await page.word(lambda m: "hello" in m))["hello"]["mode"] == "recorded"
            assert "cannot be changed" in (await page.ask(do="end"))["error"]
            await page.ask(do="watch", what="loop")  # no recording has the timing of the loop
            assert (await page.word(lambda m: "loop" in m))["loop"] == {}
            assert (await page.ask(do="row", time=0.1))["row"][0] == pytest.approx(0.1)

    try:
        asyncio.run(look())
    finally:
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
        process.stdout.close()
