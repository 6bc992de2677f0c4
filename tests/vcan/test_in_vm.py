"""Where this machine has no SocketCAN: all tests marked `vcan`, inside a virtual machine."""

import shutil
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
RUN_IN_VM = Path(__file__).with_name("run_in_vm")
TOOLS = ("qemu-system-x86_64", "busybox", "cpio", "ip", "candump", "apt-get", "dpkg-deb")


def vcan_files() -> list[str]:
    """Return the test files that speak of vcan; to import others costs the guest minutes."""
    files = set(TESTS.rglob("test_*.py")) - {Path(__file__)}
    return sorted(
        str(path.relative_to(TESTS.parent)) for path in files if "vcan" in path.read_text()
    )


REPRESENTATIVE = ("tests/bus/test_contract.py",)
"""What every run asks of the kernel: that a bus opened there does what any bus does."""

FULL = pytest.mark.full(sibling="test_what_needs_socketcan_holds_in_a_virtual_machine")


@pytest.mark.slow
@pytest.mark.parametrize(
    "files", [REPRESENTATIVE, pytest.param(vcan_files(), marks=FULL)], ids=["bus", "all"]
)
def test_what_needs_socketcan_holds_in_a_virtual_machine(files: Sequence[str]) -> None:
    """Tests that are skipped on this machine run and pass on a stock kernel."""
    if "vcan0" in (name for _, name in socket.if_nameindex()):
        pytest.skip("this machine has vcan0: the tests run here")
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)} (tests/vcan/README.md)")
    pytest_vcan = [sys.executable, "-m", "pytest", "-m", "vcan", "-p", "no:cacheprovider"]
    guest = subprocess.run(
        [str(RUN_IN_VM), *pytest_vcan, *files],
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
    )
    report = guest.stdout + guest.stderr
    assert guest.returncode == 0, report
    assert " passed" in report, report
    assert " skipped" not in report, report
