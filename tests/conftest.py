"""Fixtures that tests of several parts share."""

import errno
import socket

import pytest
from hypothesis import settings

from tests.siblings import pairs, without_sibling

# a busy machine is no failure, and the same change passes or fails each time
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.register_profile("random", deadline=None)
settings.load_profile("repeatable")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add an option that lists the tests of `.ci/full` and what stands for each."""
    parser.addoption("--siblings", action="store_true", help="list tests marked full, and stop")


@pytest.fixture
def socketcan_channel() -> str:
    """Return the name of a SocketCAN interface that is up; skip the test without one."""
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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Check that each test left to `.ci/full` has a sibling; begin with the longest test.

    That is the virtual machine: otherwise one worker ends with it alone.
    """
    if config.option.siblings:
        print("\n".join(f"{test}\n    {sibling}" for test, sibling in pairs(items)))
        pytest.exit("that is all", 0)
    if config.args == config.getini("testpaths") and (missing := without_sibling(items)):
        raise pytest.UsageError("no sibling that every run has: " + "; ".join(missing))
    items.sort(key=lambda item: item.path.name != "test_in_vm.py")
