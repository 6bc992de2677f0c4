"""Runs whose helper processes are killed, and recordings that a run requires."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hil_emulator.commands.recording import ordered
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from tests.processes import child

RUN = [sys.executable, "-m", "hil_emulator", "run", str(shipped("configs/hyq_knee.toml"))]


def test_a_run_warns_of_a_killed_helper_and_ends_with_a_required_one(tmp_path: Path) -> None:
    """A warning names the remote control; with the recording the run ends, exit code 3.

    The run waits for a SYNC that never comes: helpers are watched then, too.
    """
    process = subprocess.Popen(
        [*RUN, "--bus", "virtual:helpers", "--clock", "follow-sync", "--control", "0",
         "--record", str(tmp_path / "run.csv"), "--require-recording"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout
    assert process.stderr
    next(line for line in process.stdout if "ready" in line)
    os.kill(child(process.pid, "http_server"), signal.SIGKILL)
    lost = "remote control: its process was ended by signal 9 (SIGKILL)"
    # before it, the first start on a machine prints that it compiles
    lines = iter(process.stderr.readline, "")
    assert any(line.startswith(f"warning   {lost}") for line in lines)
    os.kill(child(process.pid, "writer_process"), signal.SIGKILL)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 3
    assert "0.000 s, 0 ticks" in out
    assert "recorded" not in out
    warning, first, second, last = err.splitlines()
    assert first.startswith(f"hil-emulator: {lost}")
    assert second == warning.removeprefix("warning   ")
    assert second.startswith("recording ")
    assert "run.csv.rec holds the data until then" in second
    assert last.startswith("the run was ended because it requires recording")


def test_a_recording_can_be_required_only_where_there_is_one() -> None:
    """The message names both options."""
    with pytest.raises(UserError, match=r"--require-recording: .* add --record FILE"):
        ordered([], True, False, None, 5.0, 1.0)
