"""Messages for a `[bus]` table that cannot work."""

import errno
import os
import socket
import subprocess
from typing import Any

import can
import pytest

from hil_emulator.bus.bus import Bus
from hil_emulator.errors import UserError


def message(settings: dict[str, Any]) -> str:
    """Return the message for wrong settings."""
    with pytest.raises(UserError) as refusal:
        Bus(settings)
    return str(refusal.value)


def test_an_unknown_interface_lists_the_usual_ones() -> None:
    """The message quotes a misspelt interface, and describes the three usual ones."""
    text = message({"interface": "virtaul", "channel": 0})
    assert "'virtaul'" in text
    for usual in ("virtual", "socketcan", "socketcand_server"):
        assert f"'{usual}'" in text
    assert "no interface" in message({"channel": "can0"})
    assert "['can0']" in message({"interface": ["can0"]})


@pytest.mark.parametrize("interface", ["virtual", "socketcan", "socketcand_server"])
def test_a_misspelt_setting_is_refused(interface: str) -> None:
    """Settings that python-can would ignore are refused, and the valid ones are listed."""
    text = message({"interface": interface, "channel": "can0", "chanel": "can1"})
    assert "chanel" in text
    assert "can_filters, channel" in text


def test_a_missing_setting_is_named() -> None:
    """The message names a required setting."""
    assert "channel" in message({"interface": "socketcan"})
    assert "'host'" in message({"interface": "socketcand", "channel": "can0"})


def test_a_port_in_use_is_named() -> None:
    """Two servers cannot share a port: the message of the second names the port."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        text = message({"interface": "socketcand_server", "port": port})
    assert f"127.0.0.1:{port}" in text
    assert "another port" in text


@pytest.mark.parametrize("port", [-1, 70000, "29536"])
def test_an_invalid_port_is_named(port: object) -> None:
    """Numbers beyond 16 bits and texts are refused with the value."""
    assert f"127.0.0.1:{port}" in message({"interface": "socketcand_server", "port": port})


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
    """No CAN in the kernel, no such interface, interface down: each has its remedy."""

    def fail(**_: object) -> can.BusABC:
        raise OSError(code, "error of the kernel")

    monkeypatch.setattr(can, "Bus", fail)
    assert advice in message({"interface": "socketcan", "channel": "can9"})


@pytest.mark.vcan
@pytest.mark.usefixtures("socketcan_channel")
def test_a_real_kernel_reports_a_missing_interface() -> None:
    """An error of the kernel leads to the remedy."""
    assert "ip link add dev nocan0" in message({"interface": "socketcan", "channel": "nocan0"})


@pytest.mark.vcan
@pytest.mark.usefixtures("socketcan_channel")
@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0,
    reason="only root creates an interface that is down",
)
def test_a_real_kernel_reports_an_interface_that_is_down() -> None:
    """Binding to it succeeds, but the error is reported before the run."""
    subprocess.run(["ip", "link", "add", "dev", "vcandown", "type", "vcan"], check=True)
    try:
        assert "vcandown up" in message({"interface": "socketcan", "channel": "vcandown"})
    finally:
        subprocess.run(["ip", "link", "delete", "vcandown"], check=True)


def test_python_can_settings_of_the_machine_are_ignored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Only the configuration counts, not CAN_CONFIG of python-can."""
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')
    monkeypatch.setenv("CAN_CHANNEL", "elsewhere")
    with (
        Bus({"interface": "virtual", "channel": "here"}) as bus,
        can.Bus(interface="virtual", channel="here", ignore_config=True) as node,
    ):
        node.send(can.Message(arbitration_id=1))
        assert len(bus.receive()) == 1


def test_a_virtual_bus_cannot_be_joined_from_outside() -> None:
    """The client command is a shell comment instead of a command that cannot work."""
    with Bus({"interface": "virtual", "channel": "here"}) as bus:
        assert bus.client_command.startswith("#")
