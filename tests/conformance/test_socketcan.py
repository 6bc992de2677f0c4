"""The suite over the CAN of the Linux kernel, against a device in another process.

The device is a node without hydraulics, so that the virtual machine with vcan0 need not compile the
model.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from suite import SUITE, inapplicable, total

from hil_emulator.conformance.cases import CASES
from hil_emulator.platform.paths import shipped

NODE = 5
EDS = shipped("eds/hydraulic_actuator.eds")
PROGRAM = Path(__file__).with_name("constant_node.py")

MATTERS = ("remote frame", "guarding", "block", "segment")
CHOSEN = [label for label, case in CASES.items() if any(word in case.name for word in MATTERS)]
"""Cases that may differ on a kernel's sockets from TCP or a virtual bus, on which all cases are
run: remote frames, and requests in quick succession. A thousand readings per second would fill the
socket of an emulated processor."""

pytestmark = pytest.mark.vcan


@pytest.fixture
def channel(socketcan_channel: str) -> Iterator[str]:
    """Yield an interface with a device on it."""
    command = [sys.executable, str(PROGRAM), "socketcan", socketcan_channel, str(NODE), str(EDS)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield socketcan_channel
        process.terminate()


def test_a_device_conforms_over_socketcan(channel: str) -> None:
    """Cases with remote frames pass, which do not apply over TCP."""
    options = ["--can", f"socketcan:{channel}", "--node", str(NODE), "--eds", str(EDS)]
    options += [word for label in CHOSEN for word in ("--case", label)]
    process = subprocess.run(
        [sys.executable, "-m", "pytest", *SUITE, *options], capture_output=True, text=True
    )
    skipped = len(inapplicable(EDS, NODE).intersection(CHOSEN))
    report = process.stdout + process.stderr
    assert total(report) == [len(CASES), len(CHOSEN) - skipped, 0, skipped], report
