"""Messages of 9 to 1785 bytes over J1939: by broadcast (BAM) or connection (SAE J1939-21, 5.10)."""

from collections import deque
from dataclasses import dataclass

from hil_emulator.frame import Frame

CONNECTION, DATA_TRANSFER = 0xEC00, 0xEB00
"""Parameter groups TP.CM and TP.DT."""
GLOBAL = 255
"""Destination address of a message to all nodes."""
PRIORITY = 7
"""Of the transport protocol (SAE J1939-21)."""
RTS, CTS, END_ACKNOWLEDGED, BAM, ABORT = 16, 17, 19, 32, 255
"""Control bytes of TP.CM."""
TIMED_OUT = 3
"""Reason of an abort (SAE J1939-21)."""
PACKET = 7
PACKET_GAP_NS = 50_000_000
"""Between two packets of a broadcast: 50 to 200 ms."""
PATIENCE_NS = 1_250_000_000
"""T3: time in which the other side of a connection answers."""


def parameter_group(can_id: int) -> int:
    """Return the PGN of an identifier; the destination of a PDU1 is not part of it."""
    group = can_id >> 8 & 0x3FFFF
    return group if group & 0xFF00 >= 0xF000 else group & 0x3FF00


def identifier(priority: int, group: int, destination: int, source: int) -> int:
    """Return the identifier of a frame to a destination (PDU1)."""
    return priority << 26 | group << 8 | destination << 8 | source


@dataclass
class _Sending:
    group: int
    data: bytes
    destination: int
    next_packet: int = 0
    allowed: int = 0
    due_ns: int = 0
    begun: bool = False

    @property
    def packets(self) -> int:
        return -(-len(self.data) // PACKET)


@dataclass
class _Receiving:
    group: int
    size: int
    deadline_ns: int
    connected: bool
    data: bytes = b""

    @property
    def packets(self) -> int:
        return -(-self.size // PACKET)


class Transport:
    """The transport protocol of one node: one message at a time, others wait."""

    def __init__(self) -> None:
        self._waiting: deque[_Sending] = deque()
        self._receiving: dict[int, _Receiving] = {}
        self._control: list[tuple[int, bytes]] = []

    def send(self, group: int, data: bytes, destination: int) -> None:
        """Queue a message; one of the same group that has not begun is replaced."""
        for item in list(self._waiting):
            if item.group == group and not item.begun:
                self._waiting.remove(item)
        self._waiting.append(_Sending(group, data, destination))

    def publish(self, now_ns: int, address: int) -> list[Frame]:
        """Return the frames due now."""
        frames = [self._frame(CONNECTION, to, address, data) for to, data in self._control]
        self._control.clear()
        if self._waiting:
            frames += self._proceed(now_ns, address, self._waiting[0])
        return frames

    def receive(self, now_ns: int, frame: Frame, address: int) -> tuple[int, bytes] | None:
        """Take a frame of the protocol; return group and data of a message that is complete."""
        source, data = frame.can_id & 0xFF, frame.data
        if len(data) < 8:
            return None
        if parameter_group(frame.can_id) == DATA_TRANSFER:
            return self._packet(now_ns, source, data)
        group = int.from_bytes(data[5:8], "little")
        if data[0] in (RTS, BAM):
            size = int.from_bytes(data[1:3], "little")
            connected = data[0] == RTS
            self._receiving[source] = _Receiving(group, size, now_ns + PATIENCE_NS, connected)
            if connected:
                self._control.append((source, bytes([CTS, data[3], 1, 255, 255]) + data[5:8]))
        else:
            self._answered(now_ns, data, group)
        return None

    def _packet(self, now_ns: int, source: int, data: bytes) -> tuple[int, bytes] | None:
        coming = self._receiving.get(source)
        if coming is None or now_ns >= coming.deadline_ns:
            self._receiving.pop(source, None)
            return None
        if data[0] != len(coming.data) // PACKET + 1:
            return None
        coming.data += data[1:]
        coming.deadline_ns = now_ns + PATIENCE_NS
        if len(coming.data) < coming.size:
            return None
        del self._receiving[source]
        if coming.connected:
            head = bytes([END_ACKNOWLEDGED]) + coming.size.to_bytes(2, "little")
            end = bytes([coming.packets, 255]) + coming.group.to_bytes(3, "little")
            self._control.append((source, head + end))
        return coming.group, coming.data[: coming.size]

    def _answered(self, now_ns: int, data: bytes, group: int) -> None:
        """Process a flow control message of the receiver of a connection."""
        if not self._waiting or self._waiting[0].group != group:
            return
        item = self._waiting[0]
        if data[0] == CTS:
            item.next_packet, item.allowed = max(data[2], 1) - 1, data[1]
            item.due_ns = now_ns + PATIENCE_NS
        elif data[0] in (END_ACKNOWLEDGED, ABORT):
            self._waiting.popleft()

    def _proceed(self, now_ns: int, address: int, item: _Sending) -> list[Frame]:
        if not item.begun:
            return self._begin(now_ns, address, item)
        if item.destination == GLOBAL:
            if now_ns < item.due_ns:
                return []
            item.due_ns = now_ns + PACKET_GAP_NS
            frames = [self._part(item, address)]
            if item.next_packet == item.packets:
                self._waiting.popleft()
            return frames
        frames = []
        while item.allowed and item.next_packet < item.packets:
            item.allowed -= 1
            frames.append(self._part(item, address))
        if not frames and now_ns >= item.due_ns:
            self._waiting.popleft()
            text = bytes([ABORT, TIMED_OUT, 255, 255, 255]) + item.group.to_bytes(3, "little")
            return [self._frame(CONNECTION, item.destination, address, text)]
        return frames

    def _begin(self, now_ns: int, address: int, item: _Sending) -> list[Frame]:
        item.begun = True
        broadcast = item.destination == GLOBAL
        item.due_ns = now_ns + (PACKET_GAP_NS if broadcast else PATIENCE_NS)
        head = bytes([BAM if broadcast else RTS]) + len(item.data).to_bytes(2, "little")
        text = head + bytes([item.packets, 255]) + item.group.to_bytes(3, "little")
        return [self._frame(CONNECTION, item.destination, address, text)]

    def _part(self, item: _Sending, address: int) -> Frame:
        """Return the next packet; the last one is filled with ones."""
        at = PACKET * item.next_packet
        item.next_packet += 1
        part = item.data[at : at + PACKET].ljust(PACKET, b"\xff")
        return self._frame(
            DATA_TRANSFER, item.destination, address, bytes([item.next_packet]) + part
        )

    @staticmethod
    def _frame(group: int, destination: int, address: int, data: bytes) -> Frame:
        return Frame(identifier(PRIORITY, group, destination, address), data, False, True)
