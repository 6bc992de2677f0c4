"""Failures of the environment: one message names each, and data are kept if possible."""

import contextlib
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hil_emulator.platform.paths import shipped
from hil_emulator.recording import journal
from hil_emulator.remote.client import request

KNEE = shipped("configs/hyq_knee.toml")
PATIENCE_S = 300  # of a cold start on a machine with other work


def started(
    *options: object, bus: str = "virtual:environment", **environment: str
) -> subprocess.Popen[str]:
    """Return an emulator that has been started."""
    command = [sys.executable, "-m", "hil_emulator", "run", KNEE, "--bus", bus, *options]
    return subprocess.Popen(
        [str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, **environment},
    )  # fmt: skip


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Return exit code and output of an emulator, which never is a traceback."""
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in errors, errors
    return process.returncode, output + errors


def lockstep(duration: str) -> tuple[str, ...]:
    """Return the options of a run without waiting times."""
    return "--clock", "lockstep", "--duration", duration


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Yield a file system of 200 kB; skip the test if it cannot be mounted."""
    folder = tmp_path / "small"
    folder.mkdir()
    options = ["-t", "tmpfs", "-o", "size=200k", "tmpfs"]
    if subprocess.run(["mount", *options, folder], capture_output=True, check=False).returncode:
        pytest.skip("no rights to mount a file system")
    yield folder
    subprocess.run(["umount", folder], check=True)


def test_a_full_disk_ends_the_recording_and_not_the_run(small_disk: Path) -> None:
    """All ticks run; the message names the reason, and what was written is readable."""
    file = small_disk / "run.rec"
    code, output = ended(started("--record", file, *lockstep("3 s")))
    assert code == 3
    assert "3000 ticks" in output
    assert "No space left on device" in output
    assert 10 < len(journal.read(file).rows) < 3000


def test_a_folder_that_is_not_writable_is_told_before_the_run() -> None:
    """Not even root writes into /proc."""
    code, output = ended(started("--record", "/proc/run.rec", *lockstep("10 ms")))
    assert code == 2
    assert "/proc/run.rec: cannot be written" in output
    assert "ticks" not in output


def test_a_folder_that_vanishes_does_not_end_the_run(tmp_path: Path) -> None:
    """The open file goes on; what is made at the end cannot be, and that is one message."""
    folder = tmp_path / "gone"
    folder.mkdir()
    process = started("--record", folder / "run.csv", "--clock", "wall", "--duration", "3 s")
    while not list(folder.iterdir()):
        time.sleep(0.05)
        assert process.poll() is None
    shutil.rmtree(folder)
    code, output = ended(process)
    assert code == 3
    assert "ticks" in output
    assert "run.csv.rec: cannot be read: No such file or directory" in output


@pytest.mark.full(sibling="test_a_folder_that_is_not_writable_is_told_before_the_run")
def test_a_home_that_is_not_writable_only_costs_the_cache() -> None:
    """The model is compiled for this run alone."""
    nowhere = "/proc/nowhere"
    home = {"HOME": nowhere, "XDG_CACHE_HOME": nowhere}
    code, output = ended(started(*lockstep("10 ms"), **home))
    assert code == 0, output
    assert "10 ticks" in output


@pytest.mark.full(sibling="model/test_compiling.py::test_processes_that_start_at_once_compile_once")
def test_four_cold_starts_at_once(tmp_path: Path) -> None:
    """On one empty cache: each runs, and the cache that they leave is a sound one."""
    cache = {"XDG_CACHE_HOME": str(tmp_path)}
    for _ in range(2):
        crowd = [started(*lockstep("10 ms"), bus=f"virtual:{n}", **cache) for n in range(4)]
        for process in crowd:
            code, output = ended(process)
            assert code == 0, output


def test_two_emulators_on_one_port_are_one_message(tmp_path: Path) -> None:
    """The second one names the port and the way out."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        layer = tmp_path / "port.toml"
        layer.write_text(f'[bus]\ninterface = "socketcand_server"\nport = {port}\n')
        command = [sys.executable, "-m", "hil_emulator", "run", KNEE, layer, *lockstep("10 ms")]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 2
        assert f"cannot listen on 127.0.0.1:{port}" in result.stderr
        assert "choose another port" in result.stderr


def test_two_hundred_clients_and_a_slow_one_do_not_hold_the_loop() -> None:
    """Idle connections to the remote control do not delay the answer to a request."""
    process = started("--control", "0", "--clock", "wall")
    assert process.stdout is not None
    port = int(next(li for li in process.stdout if li.startswith("control")).rpartition(":")[2])
    next(line for line in process.stdout if "Ctrl-C ends." in line)
    with contextlib.ExitStack() as stack:
        for n in range(200):
            idle = stack.enter_context(socket.create_connection(("127.0.0.1", port), 20))
            idle.sendall(b"GET /sta"[: n % 9])
        before = request(port, "GET", "/status")["time"]
        time.sleep(0.2)
        assert request(port, "GET", "/status")["time"] > before
    process.terminate()
    assert ended(process)[0] == 0
