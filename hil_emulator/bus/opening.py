"""Opens the python-can bus of a configuration's `[bus]` table."""

import errno
import importlib
import inspect
import os
import socket
from collections.abc import Callable, Mapping
from typing import Any

import can
from can.interfaces import BACKENDS
from can.interfaces.socketcan import SocketcanBus

from hil_emulator.bus.in_process import InProcessBus
from hil_emulator.bus.tcp_server import SocketcandServerBus
from hil_emulator.errors import UserError

# Interfaces whose constructors name all settings and ignore others without a message: a misspelt
# setting would have no effect. Hardware drivers read settings that their constructors do not name.
_STRICT = frozenset({"virtual", "socketcan", "socketcand", "socketcand_server"})

_NO_KERNEL_CAN = (errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT, errno.ESOCKTNOSUPPORT)


def open_can_bus(settings: Mapping[str, object]) -> can.BusABC:
    """Open the bus of `settings`, which are passed to python-can unchanged.

    Configuration files and environment variables of python-can are ignored.

    Raises:
        UserError: if the bus cannot be opened.

    """
    given: dict[str, Any] = dict(settings)
    interface = given.pop("interface", None)
    if not isinstance(interface, str) or interface not in BACKENDS:
        raise UserError(_unknown_interface(interface))
    _check_settings(interface, given)
    try:
        if interface == "virtual":
            return InProcessBus(**given)
        bus = can.Bus(interface=interface, ignore_config=True, **given)
        if isinstance(bus, SocketcanBus):
            _refuse_if_down(bus)
    except (can.CanError, OSError, TypeError, ValueError, NotImplementedError) as error:
        raise UserError(f"[bus] {interface}: {_explain(error, given)}") from error
    return bus


def client_command(bus: can.BusABC, settings: Mapping[str, object]) -> str:
    """Return a shell command with which a stock client joins an open bus.

    The client requests the device type of all 127 CANopen nodes and prints which nodes answer.
    Source: `canopen`'s `Network.scanner`.
    """
    client = {key: settings[key] for key in ("interface", "channel") if key in settings}
    if client["interface"] == "virtual":
        return f"# {bus.channel_info}: open to this Python process only"
    if isinstance(bus, SocketcandServerBus):
        host = "127.0.0.1" if bus.host == "0.0.0.0" else bus.host
        client = {"interface": "socketcand", "host": host, "port": bus.port}
        client["channel"] = bus.channel
    arguments = ", ".join(f"{key}={value!r}" for key, value in client.items())
    return (
        f'python -c "import canopen, time; n = canopen.Network(); n.connect({arguments}); '
        'n.scanner.search(); time.sleep(1); print(n.scanner.nodes); n.disconnect()"'
    )


def _unknown_interface(interface: object) -> str:
    interfaces = ", ".join(sorted(BACKENDS))
    what = "has no interface" if interface is None else f"interface = {interface!r} is unknown"
    return (
        f"[bus] {what}. Use 'socketcand_server' (TCP), 'socketcan' (CAN of the Linux kernel), "
        f"'virtual' (inside one process), or another interface of python-can: {interfaces}."
    )


def _check_settings(interface: str, given: Mapping[str, object]) -> None:
    if interface == "socketcan" and not given.get("channel"):
        raise UserError("[bus] socketcan: channel is missing, for instance channel = 'can0'.")
    if interface not in _STRICT:
        return
    module, name = BACKENDS[interface]
    bus_class = getattr(importlib.import_module(module), name)
    settings = {*_arguments(bus_class.__init__), *_arguments(can.BusABC.__init__)}
    unknown = sorted(set(given) - settings)
    if unknown:
        raise UserError(
            f"[bus] {interface}: no such setting: {', '.join(unknown)}. "
            f"There are: {', '.join(sorted(settings))}."
        )


def _arguments(constructor: Callable[..., None]) -> list[str]:
    parameters = list(inspect.signature(constructor).parameters.values())[1:]
    return [p.name for p in parameters if p.kind is not p.VAR_KEYWORD]


def _refuse_if_down(bus: SocketcanBus) -> None:
    """Raise the socket's error if the interface is down, since binding to it succeeds."""
    code = bus.socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
    if code:
        bus.shutdown()
        raise OSError(code, os.strerror(code))


def _explain(error: Exception, given: Mapping[str, object]) -> str:
    code = getattr(error, "errno", None)
    channel = given.get("channel")
    if code in _NO_KERNEL_CAN:
        return (
            "this kernel has no SocketCAN. Load it (modprobe can-raw vcan) or use "
            "interface = 'socketcand_server' instead."
        )
    if code == errno.ENODEV:
        return (
            f"there is no interface {channel}. Create a virtual one (ip link add dev {channel} "
            f"type vcan; ip link set {channel} up) or correct the channel."
        )
    if code == errno.ENETDOWN:
        return f"interface {channel} is down. Bring it up: ip link set {channel} up."
    if isinstance(error.__cause__, OSError) and error.__cause__.errno == errno.EADDRINUSE:
        return f"{error}. Stop the other program or choose another port; 0 takes any free one."
    return f"{error}".removesuffix(".") + "."
