"""What the frames of a node mean: for people, and as a DBC file for other tools."""

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hil_emulator.device.node import Node
from hil_emulator.frame import Frame
from hil_emulator.units import show

_NMT = {1: "start", 2: "stop", 128: "enter pre-operational", 129: "reset node", 130: "reset comm."}
_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
_SHOWN = {"Pa": "bar", "m": "mm", "A": "mA", "N": "N", "m/s": "mm/s"}


@dataclass(frozen=True)
class Field:
    """One value in a PDO: its place in bits, and how a count becomes a quantity."""

    name: str
    start: int
    bits: int
    signed: bool
    real: bool
    factor: float
    unit: str

    def value(self, data: bytes) -> float:
        """Return the value in a frame's data, in `unit`."""
        word = int.from_bytes(data, "little") >> self.start & ((1 << self.bits) - 1)
        if self.real:
            code = "<f" if self.bits == 32 else "<d"
            raw = struct.unpack(code, word.to_bytes(self.bits // 8, "little"))[0]
            return float(raw) * self.factor
        if self.signed and word >> (self.bits - 1):
            word -= 1 << self.bits
        return word * self.factor


@dataclass(frozen=True)
class Message:
    """One PDO: its name, COB-ID, length in bytes and fields."""

    name: str
    can_id: int
    size: int
    fields: tuple[Field, ...]


def messages(nodes: Iterable[Node]) -> list[Message]:
    """Return the PDOs of nodes as they are configured now."""
    found = []
    for node in nodes:
        for row in node.pdo_map():
            if row.exists:
                fields = tuple(_fields(node, row.entries))
                name = f"{row.name}_node{node.node_id}"
                found.append(Message(name, row.can_id, row.size, fields))
    return found


def _fields(node: Node, names: Sequence[str]) -> Iterable[Field]:
    start = 0
    for name in names:
        entry = node.dictionary.named(name)
        if entry is None:  # a dummy entry or one of several with that name
            return
        kind = entry.type
        yield Field(
            name, start, kind.bits, kind.low < 0, kind.kind == "real", entry.factor, entry.unit
        )
        start += kind.bits


def as_json(found: Iterable[Message]) -> list[dict[str, Any]]:
    """Return messages as JSON can hold them."""
    return [asdict(message) for message in found]


def from_json(found: Iterable[Mapping[str, Any]]) -> list[Message]:
    """Return messages that JSON has held."""
    return [
        Message(m["name"], m["can_id"], m["size"], tuple(Field(**f) for f in m["fields"]))
        for m in found
    ]


def describe(frame: Frame, known: Mapping[int, Message]) -> str:
    """Return a frame in words, as far as its COB-ID and data tell."""
    message = known.get(frame.can_id)
    if frame.remote:
        return "remote frame"
    if message is not None and len(frame.data) >= message.size:
        return f"{message.name}  " + ", ".join(_amount(f, frame.data) for f in message.fields)
    return _service(frame.can_id, frame.data)


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


def dbc(found: Sequence[Message]) -> str:
    """Return messages as the text of a DBC file, in SI units."""
    lines = ['VERSION ""', "", "NS_ :", "", "BS_:", "", "BU_:", ""]
    kinds = []
    for m in found:
        lines.append(f"BO_ {m.can_id} {m.name}: {m.size} Vector__XXX")
        for f in m.fields:
            sign = "-" if f.signed or f.real else "+"
            lines.append(
                f' SG_ {f.name} : {f.start}|{f.bits}@1{sign} ({f.factor:.12g},0) [0|0] "{f.unit}" '
                "Vector__XXX"
            )
            if f.real:
                kinds.append(f"SIG_VALTYPE_ {m.can_id} {f.name} : {1 if f.bits == 32 else 2};")
        lines.append("")
    return "\n".join([*lines, *kinds, ""])
