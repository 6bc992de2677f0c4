"""SDO segmented transfers (CiA 301 7.2.4.3.3 to 7.2.4.3.7): seven bytes, one answer each."""

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.datatype import DataType

SEGMENT = 7
MAX_DOWNLOAD = 131_072
"""Longest string or DOMAIN a client may write, in bytes (assumed)."""

DOWNLOAD_SEGMENT, UPLOAD_SEGMENT = 0x00, 0x60
"""Client command specifiers, in bits 5 to 7 of the first byte."""

_COMMAND_MASK = 0xE0
_TOGGLE, _LAST = 0x10, 0x01


def check_announcement(kind: DataType, length: int | None) -> None:
    """Refuse an announced length that the object cannot hold (0607 0012, 0607 0013)."""
    if length is not None:
        kind.check_length(length)
        if length > MAX_DOWNLOAD:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)


def check_received(kind: DataType, length: int) -> None:
    """Refuse data that are longer than their object (0607 0012, 0504 0005)."""
    if length > (kind.size or MAX_DOWNLOAD):
        raise SdoAbort(AbortCode.LENGTH_TOO_HIGH if kind.size else AbortCode.OUT_OF_MEMORY)


def check_announced(announced: int | None, length: int) -> None:
    """Refuse data of another length than the client announced (0607 0010)."""
    if announced is not None and announced != length:
        raise SdoAbort(AbortCode.LENGTH_MISMATCH)


class SegmentedDownload:
    """Collects the segments a client sends.

    Args:
        index: of the object to write.
        subindex: of the object to write.
        kind: its data type.
        size: length the client announced, or None.

    Attributes:
        done: whether the last segment has been received.
        received: the data, complete once done.

    """

    def __init__(self, index: int, subindex: int, kind: DataType, size: int | None) -> None:
        self.index, self.subindex = index, subindex
        self.done = False
        self.received = b""
        self._kind = kind
        self._size = size
        self._toggle = 0

    def takes(self, command: int) -> bool:
        """Whether a request with this first byte belongs to the transfer."""
        return command & _COMMAND_MASK == DOWNLOAD_SEGMENT

    def request(self, data: bytes) -> list[bytes]:
        """Handle a segment and return the answer (0503 0000 and length errors)."""
        toggle = _check_toggle(data[0], self._toggle)
        self.received += data[1 : 8 - (data[0] >> 1 & 7)]
        check_received(self._kind, len(self.received))
        if data[0] & _LAST:
            check_announced(self._size, len(self.received))
            self.done = True
        self._toggle ^= _TOGGLE
        return [bytes([0x20 | toggle]) + bytes(7)]


class SegmentedUpload:
    """Sends data segment by segment.

    Args:
        index: of the object read.
        subindex: of the object read.
        data: the data that are not sent yet.

    Attributes:
        done: whether the last segment has been requested.
        received: None.

    """

    def __init__(self, index: int, subindex: int, data: bytes) -> None:
        self.index, self.subindex = index, subindex
        self.done = False
        self.received: bytes | None = None
        self._data = data
        self._toggle = 0

    def takes(self, command: int) -> bool:
        """Whether a request with this first byte belongs to the transfer."""
        return command & _COMMAND_MASK == UPLOAD_SEGMENT

    def request(self, data: bytes) -> list[bytes]:
        """Return the next segment (0503 0000)."""
        toggle = _check_toggle(data[0], self._toggle)
        segment, self._data = self._data[:SEGMENT], self._data[SEGMENT:]
        self.done = not self._data
        self._toggle ^= _TOGGLE
        head = toggle | (SEGMENT - len(segment)) << 1 | (_LAST if self.done else 0)
        return [bytes([head]) + segment.ljust(SEGMENT, b"\0")]


def _check_toggle(command: int, expected: int) -> int:
    if command & _TOGGLE != expected:
        raise SdoAbort(AbortCode.TOGGLE_BIT_NOT_ALTERNATED)
    return expected
