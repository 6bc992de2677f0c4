"""A reference SDO server for comparison, written from CiA 301 7.2.4.

It has a few fixed objects instead of an EDS, stores a transfer as plain numbers instead of an
object per kind, and answers each request completely.
"""

from binascii import crc_hqx
from dataclasses import dataclass, field

BLOCK = 127
TIMEOUT_MS = 1000
TOGGLE, TIMED_OUT, UNKNOWN = 0x05030000, 0x05040000, 0x05040001
BLOCK_SIZE, SEQUENCE, CRC = 0x05040002, 0x05040003, 0x05040004
READ_ONLY, NO_OBJECT, NO_SUBINDEX = 0x06010002, 0x06020000, 0x06090011
MISMATCH, TOO_LONG, TOO_SHORT, TOO_HIGH, TOO_LOW = (
    0x06070010, 0x06070012, 0x06070013, 0x06090031, 0x06090032,
)  # fmt: skip


@dataclass
class Object:
    """An object of the reference: signed where `low` is negative, a string without limits."""

    value: bytes
    writable: bool = False
    low: int = 0
    high: int = 0


@dataclass
class Transfer:
    """A transfer under way."""

    kind: str
    key: tuple[int, int]
    data: bytes = b""
    size: int | None = None
    toggle: int = 0
    sent: int = 0
    block: int = 0
    complete: bool = False
    checked: bool = False


class Refusal(Exception):  # noqa: N818
    """The answer is an abort with this code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code:08X}")
        self.code = code


@dataclass
class SdoReference:
    """The server.

    Attributes:
        objects: by (index, sub-index).
        transfer: the transfer in progress.

    """

    objects: dict[tuple[int, int], Object]
    transfer: Transfer | None = field(default=None)

    def answer(self, request: bytes) -> list[bytes]:
        """Return the answers to a request of eight bytes."""
        key = int.from_bytes(request[1:3], "little"), request[3]
        under_way = self.transfer
        continuing = under_way is not None and self._continues(under_way, request[0])
        try:
            if under_way is not None and continuing:
                key = under_way.key
                return getattr(self, "_" + under_way.kind)(under_way, request)
            self.transfer = None
            return self._initiate(key, request)
        except Refusal as refusal:
            self.transfer = None
            return [abort(key, refusal.code)]

    def time_out(self) -> list[bytes]:
        """Return the frames that are sent if the client is silent for 1 s."""
        if self.transfer is None:
            return []
        key, self.transfer = self.transfer.key, None
        return [abort(key, TIMED_OUT)]

    @staticmethod
    def _continues(transfer: Transfer, command: int) -> bool:
        if transfer.kind == "upload":
            return command >> 5 == 3
        if transfer.kind == "download":
            return command >> 5 == 0
        if transfer.kind == "block_upload":
            return command in (0xA1, 0xA2, 0xA3)
        return command & 0xE3 == 0xC1 if transfer.complete else command != 0x80

    def _initiate(self, key: tuple[int, int], request: bytes) -> list[bytes]:
        command = request[0]
        if command >> 5 == 4:
            return []
        if command >> 5 == 1:
            return self._initiate_download(key, request)
        if command >> 5 == 2:
            return self._initiate_upload(key)
        if command >> 5 == 5 and not command & 3:
            return self._initiate_block_upload(key, request)
        if command >> 5 == 6 and not command & 1:
            return self._initiate_block_download(key, request)
        raise Refusal(UNKNOWN)

    def _initiate_download(self, key: tuple[int, int], request: bytes) -> list[bytes]:
        target = self._writable(key)
        if request[0] & 2:
            length = 4 - (request[0] >> 2 & 3) if request[0] & 1 else len(target.value)
            self._store(key, request[4 : 4 + length])
        else:
            size = int.from_bytes(request[4:], "little") if request[0] & 1 else None
            if size is not None:
                check_length(target, size)
            self.transfer = Transfer("download", key, size=size)
        return [head(0x60, key) + bytes(4)]

    def _initiate_upload(self, key: tuple[int, int]) -> list[bytes]:
        data = self._readable(key).value
        if len(data) <= 4:
            return [head(0x43 | 4 - len(data) << 2, key) + data.ljust(4, b"\0")]
        self.transfer = Transfer("upload", key, data)
        return [head(0x41, key) + len(data).to_bytes(4, "little")]

    def _initiate_block_upload(self, key: tuple[int, int], request: bytes) -> list[bytes]:
        data, block = self._readable(key).value, request[4]
        if not 1 <= block <= BLOCK:
            raise Refusal(BLOCK_SIZE)
        if 0 < request[5] >= len(data):
            return self._initiate_upload(key)
        self.transfer = Transfer("block_upload", key, data, block=block)
        return [head(0xC6, key) + len(data).to_bytes(4, "little")]

    def _initiate_block_download(self, key: tuple[int, int], request: bytes) -> list[bytes]:
        size = int.from_bytes(request[4:], "little") if request[0] & 2 else None
        target = self._writable(key)
        if size is not None:
            check_length(target, size)
        checked = bool(request[0] & 4)
        self.transfer = Transfer("block_download", key, size=size, checked=checked)
        return [head(0xA4, key) + bytes([BLOCK, 0, 0, 0])]

    def _upload(self, transfer: Transfer, request: bytes) -> list[bytes]:
        self._check_toggle(transfer, request[0])
        part, transfer.data = transfer.data[:7], transfer.data[7:]
        last = not transfer.data
        if last:
            self.transfer = None
        first = request[0] & 0x10 | 7 - len(part) << 1 | last
        return [bytes([first]) + part.ljust(7, b"\0")]

    def _download(self, transfer: Transfer, request: bytes) -> list[bytes]:
        self._check_toggle(transfer, request[0])
        transfer.data += request[1 : 8 - (request[0] >> 1 & 7)]
        check_length(self.objects[transfer.key], len(transfer.data), growing=True)
        if request[0] & 1:
            self.transfer = None
            if transfer.size not in (None, len(transfer.data)):
                raise Refusal(MISMATCH)
            self._store(transfer.key, transfer.data)
        return [bytes([0x20 | request[0] & 0x10]) + bytes(7)]

    def _block_upload(self, transfer: Transfer, request: bytes) -> list[bytes]:
        if request[0] == 0xA3 and not transfer.sent:
            return self._block(transfer)
        if request[0] == 0xA2 and transfer.sent and not transfer.complete:
            if request[1] > transfer.sent:
                raise Refusal(SEQUENCE)
            if not 1 <= request[2] <= BLOCK:
                raise Refusal(BLOCK_SIZE)
            transfer.block = request[2]
            unsent = len(transfer.data) - 7 * request[1]
            if unsent > 0:
                transfer.data = transfer.data[7 * request[1] :]
                return self._block(transfer)
            transfer.complete = True
            whole = self.objects[transfer.key].value
            checksum = crc_hqx(whole, 0).to_bytes(2, "little")
            return [bytes([0xC1 | -unsent << 2]) + checksum + bytes(5)]
        if request[0] == 0xA1 and transfer.complete:
            self.transfer = None
            return []
        raise Refusal(UNKNOWN)

    @staticmethod
    def _block(transfer: Transfer) -> list[bytes]:
        parts = [transfer.data[at : at + 7] for at in range(0, len(transfer.data), 7)]
        sent = parts[: transfer.block]
        transfer.sent = len(sent)
        numbers = [n | (0x80 if n == len(parts) else 0) for n in range(1, len(sent) + 1)]
        return [bytes([n]) + part.ljust(7, b"\0") for n, part in zip(numbers, sent, strict=True)]

    def _block_download(self, transfer: Transfer, request: bytes) -> list[bytes]:
        if transfer.complete:
            return self._end_block_download(transfer, request)
        number, last = request[0] & 0x7F, request[0] & 0x80
        if number == 0:
            raise Refusal(SEQUENCE)
        if number == transfer.sent + 1:
            transfer.sent = number
            transfer.data += request[1:]
            transfer.complete = bool(last)
        if not last and number != BLOCK:
            return []  # the client reads answers only at the end of a block
        check_length(self.objects[transfer.key], len(transfer.data) - 6, growing=True)
        acknowledged, transfer.sent = transfer.sent, 0
        return [bytes([0xA2, acknowledged, BLOCK]) + bytes(5)]

    def _end_block_download(self, transfer: Transfer, request: bytes) -> list[bytes]:
        data = transfer.data[: len(transfer.data) - (request[0] >> 2 & 7)]
        if transfer.size not in (None, len(data)):
            raise Refusal(MISMATCH)
        if transfer.checked and request[1:3] != crc_hqx(data, 0).to_bytes(2, "little"):
            raise Refusal(CRC)
        self.transfer = None
        self._store(transfer.key, data)
        return [bytes([0xA1]) + bytes(7)]

    @staticmethod
    def _check_toggle(transfer: Transfer, command: int) -> None:
        if bool(command & 0x10) != bool(transfer.toggle):
            raise Refusal(TOGGLE)
        transfer.toggle = not transfer.toggle

    def _readable(self, key: tuple[int, int]) -> Object:
        if key in self.objects:
            return self.objects[key]
        exists = any(index == key[0] for index, _ in self.objects)
        raise Refusal(NO_SUBINDEX if exists else NO_OBJECT)

    def _writable(self, key: tuple[int, int]) -> Object:
        target = self._readable(key)
        if not target.writable:
            raise Refusal(READ_ONLY)
        return target

    def _store(self, key: tuple[int, int], data: bytes) -> None:
        target = self._writable(key)
        check_length(target, len(data))
        number = int.from_bytes(data, "little", signed=target.low < 0)
        if number > target.high:
            raise Refusal(TOO_HIGH)
        if number < target.low:
            raise Refusal(TOO_LOW)
        target.value = data


def check_length(target: Object, length: int, *, growing: bool = False) -> None:
    """Refuse a length that is not the object's, or not yet while data are still growing."""
    if length > len(target.value):
        raise Refusal(TOO_LONG)
    if length < len(target.value) and not growing:
        raise Refusal(TOO_SHORT)


def head(command: int, key: tuple[int, int]) -> bytes:
    """Return the first four bytes of a request or answer."""
    return bytes([command]) + key[0].to_bytes(2, "little") + bytes([key[1]])


def abort(key: tuple[int, int], code: int) -> bytes:
    """Return an abort."""
    return head(0x80, key) + code.to_bytes(4, "little")
