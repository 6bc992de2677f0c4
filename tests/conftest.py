"""Fixtures that tests of several parts share."""

import errno
import socket

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # a busy machine is no failure
settings.load_profile("untimed")


@pytest.fixture
def socketcan_channel() -> str:
    """Return the name of a SocketCAN interface that is up; skip the test where there is none."""
    channel = "vcan0"
    try:
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as probe:
            probe.bind((channel,))
            code = probe.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
    except AttributeError:
        pytest.skip("this system has no SocketCAN")
    except OSError as error:
        why = "no such interface" if error.errno == errno.ENODEV else "no SocketCAN in this kernel"
        pytest.skip(f"{channel}: {why} (tests/vcan/README.md)")
    if code:
        pytest.skip(f"{channel} is down (tests/vcan/README.md)")
    return channel


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest test, the virtual machine, so that no worker ends with it alone."""
    items.sort(key=lambda item: item.path.name != "test_in_vm.py")
