"""SDO block transfers (CiA 301 7.2.4.3.8 to 7.2.4.3.16): up to 127 segments per answer."""

from binascii import crc_hqx

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DataType
from hil_emulator.device.sdo_segmented import SEGMENT, check_announced, check_received

MAX_BLOCK = 127
"""Segments per block; the device always offers as many as there can be."""

_COMMAND_MASK = 0xE3
_END_DOWNLOAD, _END_UPLOAD, _ACKNOWLEDGE, _START_UPLOAD = 0xC1, 0xA1, 0xA2, 0xA3
_LAST, _SEQUENCE_MASK = 0x80, 0x7F
_ABORT = 0x80


def crc(data: bytes) -> int:
    """Return the checksum of CiA 301 7.2.4.3.16: polynomial 0x1021, initial value 0."""
    return crc_hqx(data, 0)


def check_block_size(size: int) -> int:
    """Return a block size, or refuse it (0504 0002)."""
    if not 1 <= size <= MAX_BLOCK:
        raise SdoAbort(AbortCode.INVALID_BLOCK_SIZE)
    return size


class BlockDownload:
    """Collects blocks of segments; segments out of sequence are requested again.

    Data that are too long are refused at the end of the block: the client does not read answers
    within a block, and after an abort its segments would be read as requests.

    Args:
        index: of the object to write.
        subindex: of the object to write.
        kind: its data type.
        size: length the client announced, or None.
        checked: whether the client sends a checksum.

    Attributes:
        done: whether the transfer is complete.
        received: the data, complete once done.

    """

    def __init__(
        self, index: int, subindex: int, kind: DataType, size: int | None, *, checked: bool
    ) -> None:
        self.index, self.subindex = index, subindex
        self.done = False
        self.received = b""
        self._kind = kind
        self._size = size
        self._checked = checked
        self._sequence = 0  # of the last segment accepted in this block
        self._complete = False

    def takes(self, command: int) -> bool:
        """Whether a request with this first byte belongs to the transfer."""
        if self._complete:
            return command & _COMMAND_MASK == _END_DOWNLOAD
        return command != _ABORT  # a segment's first byte is its number, not a command

    def request(self, data: bytes) -> list[bytes]:
        """Handle a segment or the end; return the answer if it is due."""
        return self._end(data) if self._complete else self._segment(data)

    def _segment(self, data: bytes) -> list[bytes]:
        sequence, last = data[0] & _SEQUENCE_MASK, bool(data[0] & _LAST)
        if sequence == 0:
            raise SdoAbort(AbortCode.INVALID_SEQUENCE_NUMBER)
        if sequence == self._sequence + 1:
            self._sequence = sequence
            self.received += data[1:]
            self._complete = last
        if not last and sequence != MAX_BLOCK:
            return []
        # The last segment's padding is known only at the end.
        check_received(self._kind, len(self.received) - SEGMENT + 1)
        acknowledged, self._sequence = self._sequence, 0
        return [bytes([_ACKNOWLEDGE, acknowledged, MAX_BLOCK]) + bytes(5)]

    def _end(self, data: bytes) -> list[bytes]:
        padding = data[0] >> 2 & 7
        self.received = self.received[: len(self.received) - padding]
        check_announced(self._size, len(self.received))
        if self._checked and crc(self.received) != int.from_bytes(data[1:3], "little"):
            raise SdoAbort(AbortCode.CRC_ERROR)
        self.done = True
        return [bytes([_END_UPLOAD]) + bytes(7)]


class BlockUpload:
    """Sends blocks of segments, starting after the last acknowledged segment.

    Args:
        index: of the object read.
        subindex: of the object read.
        data: its value.
        block_size: segments per block that the client requests, 1 to 127.
        checked: whether the client requested a checksum; if not, it is sent as 0 (7.2.4.3.15).

    Attributes:
        done: whether the client has confirmed the end.
        received: None.

    """

    def __init__(
        self, index: int, subindex: int, data: bytes, block_size: int, *, checked: bool
    ) -> None:
        self.index, self.subindex = index, subindex
        self.done = False
        self.received: bytes | None = None
        self._data = data
        self._checked = checked
        self._block_size = block_size
        self._acknowledged = 0  # bytes
        self._sent = 0  # segments in the block under way
        self._ended = False

    def takes(self, command: int) -> bool:
        """Whether a request with this first byte belongs to the transfer."""
        return command in (_START_UPLOAD, _ACKNOWLEDGE, _END_UPLOAD)

    def request(self, data: bytes) -> list[bytes]:
        """Handle start, acknowledgement or end; return the next block or the end."""
        command = data[0]
        if command == _START_UPLOAD and not self._sent:
            return self._block()
        if command == _ACKNOWLEDGE and self._sent and not self._ended:
            return self._next(data[1], data[2])
        if command == _END_UPLOAD and self._ended:
            self.done = True
            return []
        raise SdoAbort(AbortCode.UNKNOWN_COMMAND)

    def _next(self, sequence: int, block_size: int) -> list[bytes]:
        if sequence > self._sent:
            raise SdoAbort(AbortCode.INVALID_SEQUENCE_NUMBER)
        self._block_size = check_block_size(block_size)
        self._acknowledged += SEGMENT * sequence
        if self._acknowledged < max(len(self._data), 1):
            return self._block()
        self._ended = True
        padding = self._acknowledged - len(self._data)
        checksum = crc(self._data) if self._checked else 0
        end = bytes([_END_DOWNLOAD | padding << 2])
        return [end + checksum.to_bytes(2, "little") + bytes(5)]

    def _block(self) -> list[bytes]:
        segments: list[bytes] = []
        at = self._acknowledged
        while len(segments) < self._block_size:
            segment = self._data[at : at + SEGMENT]
            at += SEGMENT
            last = at >= len(self._data)
            number = len(segments) + 1 | (_LAST if last else 0)
            segments.append(bytes([number]) + segment.ljust(SEGMENT, b"\0"))
            if last:
                break
        self._sent = len(segments)
        return segments
