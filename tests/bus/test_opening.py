"""What the user is told about a `[bus]` table that cannot work."""

import errno
import os
import socket
import subprocess
from typing import Any

import can
import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.errors import UserError


def told(settings: dict[str, Any]) -> str:
    """Return what the user is told when these settings are used."""
    with pytest.raises(UserError) as refusal:
        Bus(settings)
    return str(refusal.value)


def test_an_unknown_interface_is_told_with_the_known_ones() -> None:
    """A misspelt interface is quoted, and the three usual ones come with what they are."""
    text = told({"interface": "virtaul", "channel": 0})
    assert "'virtaul'" in text
    for known in ("virtual", "socketcan", "socketcand_server"):
        assert f"'{known}'" in text
    assert "no interface" in told({"channel": "can0"})
    assert "['can0']" in told({"interface": ["can0"]})


@pytest.mark.parametrize("interface", ["virtual", "socketcan", "socketcand_server"])
def test_a_misspelt_setting_is_not_swallowed(interface: str) -> None:
    """python-can ignores settings it does not know; here they are refused, and the right named."""
    text = told({"interface": interface, "channel": "can0", "chanel": "can1"})
    assert "chanel" in text
    assert "can_filters, channel" in text


def test_a_missing_setting_is_named() -> None:
    """What the interface cannot do without is asked for by name."""
    assert "channel" in told({"interface": "socketcan"})
    assert "'host'" in told({"interface": "socketcand", "channel": "can0"})


def test_a_port_in_use_is_told() -> None:
    """Two servers cannot share a port: the second says which one it wanted."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        text = told({"interface": "socketcand_server", "port": port})
    assert f"127.0.0.1:{port}" in text
    assert "another port" in text


@pytest.mark.parametrize("port", [-1, 70000, "29536"])
def test_a_port_that_is_none_is_told(port: object) -> None:
    """Numbers beyond 16 bits and texts are refused with the value."""
    assert f"127.0.0.1:{port}" in told({"interface": "socketcand_server", "port": port})


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        (errno.EAFNOSUPPORT, "socketcand_server"),
        (errno.ENODEV, "ip link add dev can9 type vcan"),
        (errno.ENETDOWN, "ip link set can9 up"),
    ],
)
def test_each_failure_of_socketcan_comes_with_its_remedy(
    monkeypatch: pytest.MonkeyPatch, code: int, advice: str
) -> None:
    """No CAN in the kernel, no such interface, interface down: three remedies."""

    def fail(**_: object) -> can.BusABC:
        raise OSError(code, "as the kernel would say")

    monkeypatch.setattr(can, "Bus", fail)
    assert advice in told({"interface": "socketcan", "channel": "can9"})


@pytest.mark.vcan
@pytest.mark.usefixtures("socketcan_channel")
def test_a_real_kernel_reports_a_missing_interface() -> None:
    """The kernel's own error leads to the advice."""
    assert "ip link add dev nocan0" in told({"interface": "socketcan", "channel": "nocan0"})


@pytest.mark.vcan
@pytest.mark.usefixtures("socketcan_channel")
@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0,
    reason="only root creates an interface that is down",
)
def test_a_real_kernel_reports_an_interface_that_is_down() -> None:
    """Binding to it succeeds, yet the user is told before the run and not by its silence."""
    subprocess.run(["ip", "link", "add", "dev", "vcandown", "type", "vcan"], check=True)
    try:
        assert "vcandown up" in told({"interface": "socketcan", "channel": "vcandown"})
    finally:
        subprocess.run(["ip", "link", "delete", "vcandown"], check=True)


def test_the_machine_s_own_python_can_settings_have_no_say(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A rig is what its file says, whatever CAN_CONFIG of python-can holds."""
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')
    monkeypatch.setenv("CAN_CHANNEL", "elsewhere")
    with (
        Bus({"interface": "virtual", "channel": "here"}) as bus,
        can.Bus(interface="virtual", channel="here", ignore_config=True) as node,
    ):
        node.send(can.Message(arbitration_id=1))
        assert len(bus.receive()) == 1


def test_a_virtual_bus_says_that_it_cannot_be_joined_from_outside() -> None:
    """The client command is a comment to a shell, not a line that cannot work."""
    with Bus({"interface": "virtual", "channel": "here"}) as bus:
        assert bus.client_command.startswith("#")
