"""The plugin in a test suite of its own."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

FAILING = """
def test_fails(emulator, network, inject, run_for):
    network[5].nmt.state = "OPERATIONAL"
    inject("position", "offset", value="3 mm")
    run_for("30 ms")
    assert emulator.signals.position < 0.04
"""


def suite(folder: Path, text: str, *options: str) -> str:
    """Run a test file in a process of its own and return the output."""
    (folder / "test_it.py").write_text(text)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "test_it.py", *options]
    result = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )
    return result.stdout + result.stderr


def test_a_failing_test_tells_frames_signals_seed_and_replay(tmp_path: Path) -> None:
    """The last 20 frames decoded, the signals, what was broken, and two commands."""
    text = suite(tmp_path, FAILING)
    frames = re.findall(r"^ +\d\.\d{3} s  (?:out|in ).*", text, re.M)
    assert len(frames) == 20
    assert any("node5_TPDO2  position 43." in line for line in frames)
    assert "emulator time 0.032 s, seed 1" in text
    assert "position offset, value 3 mm" in text
    assert re.search(r"model\.position +(40|39\.9)\S* mm", text)
    assert "--emulator-seed 1" in text
    assert (tmp_path / ".hil-emulator" / ".gitignore").read_text() == "*\n"


@pytest.mark.slow
def test_the_command_in_the_report_replays_the_failure(tmp_path: Path) -> None:
    """The frames and the fault of the failed test, bit for bit."""
    text = suite(tmp_path, FAILING, "--emulator-seed", "4")
    (command,) = re.findall(r"replay the frames: +hil-emulator (.*)", text)
    result = subprocess.run(
        [sys.executable, "-m", "hil_emulator", *command.split()],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert "the same, bit for bit" in result.stdout, result.stdout + result.stderr


@pytest.mark.slow
def test_the_report_reaches_the_terminal_under_xdist(tmp_path: Path) -> None:
    """What a worker process has seen is shown by the one that started it."""
    text = suite(tmp_path, FAILING, "-n", "2")
    assert "last 20 frames:" in text


def test_a_missing_configuration_is_one_clear_message(tmp_path: Path) -> None:
    """The file is named."""
    text = suite(tmp_path, FAILING, "--emulator-config", "nowhere.toml")
    assert "nowhere.toml: no such file" in text


@pytest.mark.slow
def test_the_example_of_the_pages_passes(tmp_path: Path) -> None:
    """The printed example passes with the machine of the CI templates."""
    page = (Path(__file__).parents[2] / "docs/how_to/ci.md").read_text()
    (code,) = re.findall(r"^```python\n(# test_step\.py\n.*?)^```$", page, re.M | re.S)
    assert "1 passed" in suite(tmp_path, code, "--emulator-config", "hyq_knee")


@pytest.mark.slow
def test_nothing_is_imported_for_tests_that_do_not_use_it(tmp_path: Path) -> None:
    """A suite that knows nothing of emulators pays nothing: numba and python-can stay out."""
    text = """
import sys
def test_it():
    assert not {"numba", "can", "canopen", "pint"} & sys.modules.keys()
"""
    assert "1 passed" in suite(tmp_path, text)
