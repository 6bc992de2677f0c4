"""Actuators that share nothing run in separate processes, with the same results."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest

from hil_emulator.platform.paths import shipped
from hil_emulator.platform.worker import can_fork
from tests.processes import children, descendants

KNEE = shipped("configs/hyq_knee.toml")
COMMAND = [sys.executable, "-m", "hil_emulator", "run"]

pytestmark = pytest.mark.skipif(not can_fork(), reason="one process on this system")


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """Return a machine of two actuators, each with a bus on a separate TCP port."""
    text = "".join(
        f'[buses.{name}]\ninterface = "socketcand_server"\nchannel = "can0"\nport = 0\n'
        f'[[actuator]]\nname = "{name}"\nfiles = ["{KNEE}"]\nbus = "{name}"\n'
        for name in ("left", "right")
    )
    file = tmp_path / "pair.toml"
    file.write_text(text)
    return file


def finished(*words: object) -> subprocess.CompletedProcess[str]:
    """Return a run that has ended."""
    command = [*COMMAND, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


@contextmanager
def running(*words: object) -> Iterator[tuple["subprocess.Popen[str]", list[str]]]:
    """Yield a run that is ready and the lines that it has printed; it is ended at the end."""
    process = subprocess.Popen(
        [*COMMAND, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout
    lines = list(iter(process.stdout.readline, "ready\n"))
    try:
        yield process, lines
    finally:
        process.terminate()
        process.communicate(timeout=60)


def workers_of(process: "subprocess.Popen[str]") -> list[int]:
    """Return the numbers of the processes that a run has started."""
    return list(children(process.pid))


def alive(number: int) -> bool:
    """Tell whether a process is there and has not ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
def test_recordings_are_those_of_one_process(pair: Path, tmp_path: Path) -> None:
    """Signals, frames and a fault's effect are the same, bit for bit, in one process or two."""
    for count in (1, 2):
        result = finished(
            pair, "--clock", "lockstep", "--duration", "0.3 s", "--processes", count,
            "--fault", "left.supply droop start='0.1 s'", "--record", tmp_path / f"in{count}.rec",
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
        assert result.stdout.count("300 ticks") == count
        assert ("process   right" in result.stdout) == (count == 2)
    for name in ("left", "right"):
        one, two = (tmp_path / f"in{count}_{name}.rec" for count in (1, 2))
        assert one.read_bytes() == two.read_bytes()


def test_every_bus_is_served_and_one_signal_ends_all(pair: Path) -> None:
    """A client on either bus receives its node's heartbeat; SIGTERM ends both parts in order."""
    with running(pair, "--processes", 2) as (process, lines):
        ports = [line.rsplit(":", 1)[1] for line in lines if line.startswith("bus ")]
        assert len(ports) == 2
        for port in ports:
            with can.Bus(interface="socketcand", host="127.0.0.1", port=int(port),
                         channel="can0") as client:  # fmt: skip
                message = client.recv(10.0)
            assert message is not None
            assert message.arbitration_id & 0x780 == 0x700
        assert len(workers_of(process)) == 2
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert out.count("0 dropped") == 2
    assert out.index("process   left") < out.index("process   right")


def test_a_part_that_cannot_begin_ends_all_with_one_message(pair: Path) -> None:
    """A port in use causes one message and exit code 2; no process stays behind."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        pair.write_text(pair.read_text().replace("port = 0", f"port = {port}", 1))
        result = finished(pair, "--processes", 2)
    assert result.returncode == 2
    assert str(port) in result.stderr
    assert "Traceback" not in result.stderr
    assert "process" not in result.stdout
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_part_whose_recording_fails_goes_on(pair: Path, tmp_path: Path) -> None:
    """A warning names the part; all go on until the run is ended, whose exit code is 3."""
    file = tmp_path / "run.rec"
    with running(pair, "--processes", 2, "--record", file) as (process, _):
        (left,) = [n for n, line in descendants(process.pid).items() if "run_left.rec" in line]
        os.kill(left, signal.SIGKILL)
        assert process.stderr
        warning = process.stderr.readline()
        assert "run_left.rec: its process was ended by signal 9" in warning
        assert warning.endswith("(left)\n")
        assert all(map(alive, workers_of(process)))
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 3
    assert "run_left.rec: its process was ended by signal 9" in err
    assert "Traceback" not in err
    assert f"recorded  {tmp_path / 'run_right.rec'}" in out


@pytest.mark.parametrize("victim", ["a worker", "the foreman"])
def test_no_process_outlives_the_others(pair: Path, victim: str) -> None:
    """The run ends after a worker was killed; if it is killed itself, it leaves no worker."""
    with running(pair, "--processes", 2) as (process, _):
        workers = workers_of(process)
        os.kill(workers[0] if victim == "a worker" else process.pid, signal.SIGKILL)
        _, err = process.communicate(timeout=60)
    while any(map(alive, workers)):
        time.sleep(0.01)
    if victim == "a worker":
        assert process.returncode == 3
        assert "the process of left was ended by signal 9 (SIGKILL)" in err
