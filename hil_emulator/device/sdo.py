"""SDO server (CiA 301 7.2.4): one transfer at a time, with a time-out.

One client has one channel, so there is one transfer at a time. An upload is answered when the
tick's sample is in the dictionary, so that it agrees with the tick's TPDOs. A new initiate request
replaces an unfinished transfer, which its client has abandoned.
"""

import struct
from dataclasses import dataclass
from typing import Protocol

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.sdo_block import MAX_BLOCK, BlockDownload, BlockUpload, check_block_size
from hil_emulator.device.sdo_segmented import (
    SegmentedDownload,
    SegmentedUpload,
    check_announcement,
)
from hil_emulator.frame import Frame

SDO_SERVER_PARAMETER = 0x1200
TIMEOUT_NS = 1_000_000_000
"""Time-out of a transfer. CiA 301 does not define it; 1 s is common (assumed)."""

_HEAD = struct.Struct("<BHB")
_HEAD_AND_SIZE = struct.Struct("<BHBI")
_COMMAND_MASK = 0xE0
_DOWNLOAD, _UPLOAD, _ABORT, _BLOCK_UPLOAD, _BLOCK_DOWNLOAD = 0x20, 0x40, 0x80, 0xA0, 0xC0
_EXPEDITED, _SIZE = 0x02, 0x01
_BLOCK_CRC, _BLOCK_SIZE, _BLOCK_SUBCOMMAND = 0x04, 0x02, 0x01


class _Transfer(Protocol):
    """A transfer under way; it is finished once `done`."""

    index: int
    subindex: int
    done: bool

    @property
    def received(self) -> bytes | None: ...

    def takes(self, command: int) -> bool: ...

    def request(self, data: bytes) -> list[bytes]: ...


@dataclass(frozen=True, slots=True)
class _PendingUpload:
    """A requested upload that is not answered yet; block size 0 is no block transfer.

    `checked` is whether the client supports a checksum.
    """

    index: int
    subindex: int
    block_size: int = 0
    threshold: int = 0
    checked: bool = False


class SdoServer:
    """Answers the requests of one SDO client.

    Args:
        dictionary: the objects that are read and written.
        index: the channel's parameters, 0x1200 to 0x127F.

    """

    def __init__(self, dictionary: Dictionary, index: int = SDO_SERVER_PARAMETER) -> None:
        self._dictionary = dictionary
        self._index = index
        self.reset()

    @property
    def exists(self) -> bool:
        """Whether both COB-IDs of the channel are valid."""
        return not (self._cob_id(1, 0x600) | self._cob_id(2, 0x580)) & cob_id.INVALID

    @property
    def request_can_id(self) -> int:
        """Identifier of the client's requests: sub-index 1, or the predefined one."""
        return self._cob_id(1, 0x600) & cob_id.CAN_ID_MASK

    @property
    def answer_can_id(self) -> int:
        """Identifier of the answers: sub-index 2, or the predefined one."""
        return self._cob_id(2, 0x580) & cob_id.CAN_ID_MASK

    def _cob_id(self, subindex: int, predefined: int) -> int:
        entry = self._dictionary.get(self._index, subindex)
        return predefined + self._dictionary.node_id if entry is None else int(entry.value)

    @property
    def busy(self) -> bool:
        """Whether a transfer is under way, which may time out."""
        return self._transfer is not None

    def reset(self) -> None:
        """Drop the transfer under way and all answers not yet sent."""
        self._answer_can_id = self.answer_can_id
        self._transfer: _Transfer | None = None
        self._upload: _PendingUpload | None = None
        self._answers: list[bytes] = []
        self._last_ns = 0

    def request(self, now_ns: int, data: bytes) -> None:
        """Handle a request; a frame of other than eight bytes is not an SDO and is ignored."""
        if len(data) != 8:
            return
        self._answer_upload()
        self._last_ns = now_ns
        transfer = self._transfer
        _, index, subindex = _HEAD.unpack_from(data)
        try:
            if transfer is not None and transfer.takes(data[0]):
                index, subindex = transfer.index, transfer.subindex
                self._proceed(transfer, data)
            else:
                self._transfer = None
                self._initiate(data, index, subindex)
        except SdoAbort as abort:
            self._abort(index, subindex, abort.code)

    def publish(self, now_ns: int, frames: list[Frame]) -> None:
        """Append the answers, or the abort of a transfer that timed out."""
        self._answer_upload()
        transfer = self._transfer
        if transfer is not None and now_ns - self._last_ns >= TIMEOUT_NS:
            self._abort(transfer.index, transfer.subindex, AbortCode.TIMED_OUT)
        if self._answers:
            frames.extend([Frame(self._answer_can_id, answer) for answer in self._answers])
            self._answers.clear()

    def _proceed(self, transfer: _Transfer, data: bytes) -> None:
        answers = transfer.request(data)
        if transfer.done:
            self._transfer = None
            if transfer.received is not None:
                self._dictionary.download(transfer.index, transfer.subindex, transfer.received)
        self._answers += answers

    def _initiate(self, data: bytes, index: int, subindex: int) -> None:
        command = data[0] & _COMMAND_MASK
        if command == _DOWNLOAD:
            self._initiate_download(data, index, subindex)
        elif command == _UPLOAD:
            self._dictionary.read(index, subindex)
            self._upload = _PendingUpload(index, subindex)
        elif command == _BLOCK_DOWNLOAD and not data[0] & _BLOCK_SUBCOMMAND:
            self._initiate_block_download(data, index, subindex)
        elif command == _BLOCK_UPLOAD and not data[0] & (_BLOCK_SUBCOMMAND | _BLOCK_SIZE):
            self._dictionary.read(index, subindex)
            size = check_block_size(data[4])
            checked = bool(data[0] & _BLOCK_CRC)
            self._upload = _PendingUpload(index, subindex, size, data[5], checked)
        elif command != _ABORT:
            raise SdoAbort(AbortCode.UNKNOWN_COMMAND)

    def _initiate_download(self, data: bytes, index: int, subindex: int) -> None:
        kind = self._dictionary.writable(index, subindex).type
        if data[0] & _EXPEDITED:
            size = 4 - (data[0] >> 2 & 3) if data[0] & _SIZE else kind.size or 4
            self._dictionary.download(index, subindex, data[4 : 4 + size])
        else:
            announced = int.from_bytes(data[4:], "little") if data[0] & _SIZE else None
            check_announcement(kind, announced)
            self._transfer = SegmentedDownload(index, subindex, kind, announced)
        self._answers.append(_HEAD.pack(0x60, index, subindex) + bytes(4))

    def _initiate_block_download(self, data: bytes, index: int, subindex: int) -> None:
        kind = self._dictionary.writable(index, subindex).type
        announced = int.from_bytes(data[4:], "little") if data[0] & _BLOCK_SIZE else None
        check_announcement(kind, announced)
        checked = bool(data[0] & _BLOCK_CRC)
        self._transfer = BlockDownload(index, subindex, kind, announced, checked=checked)
        head = _HEAD.pack(0xA0 | _BLOCK_CRC, index, subindex)
        self._answers.append(head + bytes([MAX_BLOCK, 0, 0, 0]))

    def _answer_upload(self) -> None:
        """Answer the initiate of an upload with the object's present value."""
        if self._upload is None:
            return
        wanted, self._upload = self._upload, None
        index, subindex = wanted.index, wanted.subindex
        try:
            data = self._dictionary.upload(index, subindex)
        except SdoAbort as abort:
            self._abort(index, subindex, abort.code)
            return
        # A client may name a length up to which it prefers no block transfer (7.2.4.3.13).
        if wanted.block_size and (not wanted.threshold or len(data) > wanted.threshold):
            self._transfer = BlockUpload(
                index, subindex, data, wanted.block_size, checked=wanted.checked
            )
            # A stock client expects a checksum if one is offered, also if it requested no checksum.
            head = 0xC0 | _BLOCK_SIZE | (_BLOCK_CRC if wanted.checked else 0)
            self._answers.append(_HEAD_AND_SIZE.pack(head, index, subindex, len(data)))
        elif 1 <= len(data) <= 4:
            head = 0x40 | (4 - len(data)) << 2 | _EXPEDITED | _SIZE
            self._answers.append(_HEAD.pack(head, index, subindex) + data.ljust(4, b"\0"))
        else:
            self._transfer = SegmentedUpload(index, subindex, data)
            self._answers.append(_HEAD_AND_SIZE.pack(0x40 | _SIZE, index, subindex, len(data)))

    def _abort(self, index: int, subindex: int, code: AbortCode) -> None:
        self._transfer = None
        self._answers.append(_HEAD_AND_SIZE.pack(0x80, index, subindex, code))
