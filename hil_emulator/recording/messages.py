"""Meaning of a node's frames, kept in a recording and shown in words."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from hil_emulator.device.message import Field, Message, message
from hil_emulator.device.node import Node
from hil_emulator.device.service_messages import services
from hil_emulator.frame import Frame
from hil_emulator.units import show

_NMT = {1: "start", 2: "stop", 128: "enter pre-operational", 129: "reset node", 130: "reset comm."}
_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
_SHOWN = {"Pa": "bar", "m": "mm", "A": "mA", "N": "N", "m/s": "mm/s"}


def messages(nodes: Iterable[Node]) -> list[Message]:
    """Return the PDOs of nodes in their present configuration."""
    return [message(f"node{n.node_id}", pdo) for n in nodes for pdo in n.pdos if pdo.active]


def service_messages(nodes: Iterable[Node]) -> list[Message]:
    """Return the messages of their other services."""
    return services({f"node{n.node_id}": n for n in nodes})


def as_json(listed: Iterable[Message]) -> list[dict[str, Any]]:
    """Return messages for JSON."""
    return [asdict(message) for message in listed]


def from_json(listed: Iterable[Mapping[str, Any]]) -> list[Message]:
    """Return messages from JSON."""
    return [Message(**{**m, "fields": tuple(Field(**f) for f in m["fields"])}) for m in listed]


def describe(frame: Frame, pdos: Mapping[int, Message]) -> str:
    """Return a frame in words, by identifier and data.

    Args:
        frame: frame to describe.
        pdos: PDOs by `Message.identifier`.

    """
    pdo = pdos.get(frame.identifier)
    if frame.remote:
        return "remote frame"
    if pdo is not None and len(frame.data) >= pdo.size:
        return f"{pdo.name}  " + ", ".join(_amount(f, frame.data) for f in pdo.fields)
    return "" if frame.extended else _service(frame.can_id, frame.data)


def _amount(field: Field, data: bytes) -> str:
    value = field.value(data)
    if field.unit in _SHOWN:
        return f"{field.name} {show(value, field.unit, _SHOWN[field.unit])}"
    return f"{field.name} {value:g}"


def _service(can_id: int, data: bytes) -> str:
    """Return the CiA 301 service of a COB-ID of the predefined connection set."""
    if can_id == 0 and len(data) == 2:
        who = f"node {data[1]}" if data[1] else "all nodes"
        return f"NMT  {_NMT.get(data[0], data[0])}, {who}"
    if can_id == 0x080:
        return "SYNC"
    service, node = can_id & 0x780, can_id & 0x7F
    if service == 0x080 and len(data) == 8:
        return f"EMCY node {node}  code {data[1]:02X}{data[0]:02X}, register {data[2]:02X}"
    if service == 0x700 and len(data) == 1:
        return f"heartbeat node {node}  {_STATES.get(data[0] & 0x7F, data[0])}"
    if service in (0x580, 0x600) and len(data) == 8:
        side = "answer" if service == 0x580 else "request"
        index = int.from_bytes(data[1:3], "little")
        return f"SDO {side} node {node}  {index:04X}:{data[3]:02X}"
    return ""
