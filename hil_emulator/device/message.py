"""A message of the bus: position and scale of each value in its data."""

import struct
from dataclasses import dataclass

from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo import PdoParameters
from hil_emulator.frame import EXTENDED


@dataclass(frozen=True)
class Field:
    """One value in a message: its place in bits, and how a count becomes a quantity.

    Attributes:
        name: of the object.
        start: its least significant bit in the data.
        bits: its length.
        signed: whether it is an integer in two's complement.
        real: whether it is an IEEE 754 number.
        factor: `unit` per count.
        offset: value of count 0, in `unit`.
        unit: "" without one.
        index: of the object.
        subindex: of the object.
        low: smallest count a client may write; None without a limit.
        high: largest count a client may write; None without a limit.
        choices: names the words for its counts in `service_messages.WORDS`; "" without any.

    """

    name: str
    start: int
    bits: int
    signed: bool
    real: bool
    factor: float
    unit: str
    index: int = 0
    subindex: int = 0
    low: float | None = None
    high: float | None = None
    choices: str = ""
    offset: float = 0.0

    def value(self, data: bytes) -> float:
        """Return the value in a frame's data, in `unit`."""
        word = int.from_bytes(data, "little") >> self.start & ((1 << self.bits) - 1)
        if self.real:
            code = "<f" if self.bits == 32 else "<d"
            raw = struct.unpack(code, word.to_bytes(self.bits // 8, "little"))[0]
            return float(raw) * self.factor + self.offset
        if self.signed and word >> (self.bits - 1):
            word -= 1 << self.bits
        return word * self.factor + self.offset


@dataclass(frozen=True)
class Message:
    """One PDO, or a message of another service, as it is configured now.

    Attributes:
        node: name of its node; "" for what belongs to the bus.
        pdo: such as "TPDO1"; of another service its name, such as "EMCY".
        can_id: identifier.
        size: bytes of data.
        transmission_type: see `PdoParameters`.
        event_timer_ms: see `PdoParameters`.
        fields: what it carries, without dummy entries.
        extended: whether its identifier has 29 bits.

    """

    node: str
    pdo: str
    can_id: int
    size: int
    transmission_type: int
    event_timer_ms: int
    fields: tuple[Field, ...]
    extended: bool = False

    @property
    def identifier(self) -> int:
        """The unique identifier of its frames: see `Frame.identifier`."""
        return self.can_id | EXTENDED if self.extended else self.can_id

    @property
    def name(self) -> str:
        """Unique on the bus, such as "node5_TPDO1"."""
        return f"{self.node}_{self.pdo}" if self.node else self.pdo

    @property
    def receive(self) -> bool:
        """Whether the node receives it."""
        return self.pdo.startswith("RPDO") or self.pdo.endswith("_request")


def message(node: str, pdo: PdoParameters) -> Message:
    """Return a PDO of a node as a message."""
    return Message(
        node, pdo.name, pdo.can_id, pdo.mapping.size, pdo.transmission_type, pdo.event_timer_ms,
        tuple(field(start, entry) for start, entry in pdo.mapping.placed()),
        pdo.extended,
    )  # fmt: skip


def field(start: int, entry: Entry) -> Field:
    """Return an object at a place in a PDO as a field."""
    kind = entry.type
    return Field(
        entry.name, start, kind.bits, kind.low < 0, kind.kind == "real", entry.factor, entry.unit,
        entry.index, entry.subindex, entry.low, entry.high, offset=entry.offset,
    )  # fmt: skip
