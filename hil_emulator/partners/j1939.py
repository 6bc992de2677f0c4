"""A partner that speaks SAE J1939: address claim, requests, messages of up to 1785 bytes.

Identifiers have priority, parameter group number (PGN) and source address (SAE J1939-21). The DBC
gives priority and PGN; the source address is the one that the partner has claimed (J1939-81).
"""

from collections.abc import Sequence
from dataclasses import dataclass

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.measured import Measured
from hil_emulator.frame import Frame
from hil_emulator.partners.commands import ObeyedMessage
from hil_emulator.partners.partner import Partner
from hil_emulator.partners.sent_message import SentMessage
from hil_emulator.partners.transport import (
    CONNECTION,
    DATA_TRANSFER,
    GLOBAL,
    Transport,
    identifier,
    parameter_group,
)

REQUEST, ACKNOWLEDGEMENT, ADDRESS_CLAIMED = 0xEA00, 0xE800, 0xEE00
"""Parameter groups (SAE J1939-21, J1939-81)."""
NO_ADDRESS = 254
"""Source address of a node that cannot claim one."""
ARBITRARY = range(128, 248)
"""Addresses to choose from after a lost claim (J1939-81)."""
CLAIM_NS = 250_000_000
"""Time in which others may contest an address (J1939-81)."""
NOT_SUPPORTED = 1
"""Control byte of a negative acknowledgement."""
PRIORITY = 6
"""Of claims, requests and transport (J1939-21)."""


@dataclass(frozen=True)
class Name:
    """NAME of a node (SAE J1939-81).

    Attributes:
        identity: 21 bits, the maker's number of this node.
        manufacturer: 11 bits.
        function: 8 bits.
        arbitrary: whether the node may take another address.

    """

    identity: int
    manufacturer: int
    function: int
    arbitrary: bool

    @property
    def value(self) -> int:
        """The number; the smaller one keeps an address."""
        return (
            self.identity
            | self.manufacturer << 21
            | self.function << 40
            | int(self.arbitrary) << 63
        )


class J1939Partner(Partner):
    """A partner with an address.

    Args:
        name: for messages to the user.
        sent: what it sends.
        obeyed: what it obeys, from any source.
        identity: its NAME.
        address: the one that it claims.

    Attributes:
        address: the present one, `NO_ADDRESS` without one.

    """

    def __init__(
        self,
        name: str,
        sent: Sequence[SentMessage],
        obeyed: Sequence[ObeyedMessage],
        identity: Name,
        address: int,
    ) -> None:
        super().__init__(name, sent, obeyed)
        self.address = address
        self._name = identity
        self._taken: set[int] = set()
        self._claim_due = True
        self._ready_ns = NEVER
        self._requested: list[tuple[int, int]] = []
        self._answers: list[Frame] = []
        self._transport = Transport()
        self._groups = {parameter_group(m.message.frame_id): m for m in sent}
        self._obeyed = {parameter_group(m.message.frame_id): m for m in obeyed}

    def take(self, now_ns: int, frame: Frame) -> None:
        """Take a frame to this address or to all."""
        if not frame.extended:
            return
        group, source = parameter_group(frame.can_id), frame.can_id & 0xFF
        destination = _destination(frame.can_id)
        if group == ADDRESS_CLAIMED:
            self._contest(source, frame.data)
        elif destination not in (self.address, GLOBAL):
            return
        elif group == REQUEST and len(frame.data) >= 3:
            self._requested.append((int.from_bytes(frame.data[:3], "little"), source))
        elif group in (CONNECTION, DATA_TRANSFER):
            whole = self._transport.receive(now_ns, frame, self.address)
            if whole is not None:
                self._obey(now_ns, *whole)
        else:
            self._obey(now_ns, group, frame.data)

    def publish(self, now_ns: int, measured: Measured) -> list[Frame]:
        """Return the claim, answers, what is due, and parts of long messages."""
        frames: list[Frame] = []
        if self._claim_due:
            self._claim_due = False
            self._ready_ns = now_ns + CLAIM_NS
            frames.append(self._claim())
        ready = now_ns >= self._ready_ns and self.address != NO_ADDRESS
        for group, source in self._requested:
            frames += self._answer(now_ns, group, source, measured, ready=ready)
        self._requested.clear()
        if ready:
            frames += super().publish(now_ns, measured)
            frames += self._transport.publish(now_ns, self.address)
        return frames

    def frames(self, now_ns: int, sent: SentMessage, data: bytes) -> list[Frame]:
        """Return the frames that carry a message; a long one is queued for the transport."""
        can_id = sent.message.frame_id & ~0xFF | self.address
        if len(data) <= 8:
            return [Frame(can_id, data, False, True)]
        self._transport.send(parameter_group(can_id), data, _destination(can_id))
        return []

    def _obey(self, now_ns: int, group: int, data: bytes) -> None:
        if group in self._obeyed:
            self._obeyed[group].receive(now_ns, data)

    def _contest(self, source: int, data: bytes) -> None:
        """Keep or leave an address that another node claims: the smaller NAME keeps it."""
        self._taken.add(source)
        if source != self.address or len(data) < 8:
            return
        if self._name.value > int.from_bytes(data[:8], "little"):
            free = [a for a in ARBITRARY if a not in self._taken] if self._name.arbitrary else []
            self.address = free[0] if free else NO_ADDRESS
        self._claim_due = True

    def _claim(self) -> Frame:
        can_id = identifier(PRIORITY, ADDRESS_CLAIMED, GLOBAL, self.address)
        return Frame(can_id, self._name.value.to_bytes(8, "little"), False, True)

    def _answer(
        self, now_ns: int, group: int, source: int, measured: Measured, *, ready: bool
    ) -> list[Frame]:
        """Answer a request: by the message, by the claim, or negatively."""
        if group == ADDRESS_CLAIMED:
            return [self._claim()]
        if not ready:
            return []
        message = self._groups.get(group)
        if message is not None:
            data = message.data(now_ns, measured)
            return self.frames(now_ns, message, data)
        can_id = identifier(PRIORITY, ACKNOWLEDGEMENT, GLOBAL, self.address)
        data = bytes([NOT_SUPPORTED, 0xFF, 0xFF, 0xFF, source]) + group.to_bytes(3, "little")
        return [Frame(can_id, data, False, True)]


def _destination(can_id: int) -> int:
    """Return the address that a frame is for, `GLOBAL` for all."""
    return GLOBAL if can_id >> 16 & 0xFF >= 0xF0 else can_id >> 8 & 0xFF
