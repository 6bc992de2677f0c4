"""SDO server: expedited and segmented transfers (CiA 301 7.2.4).

One transfer at a time, as one client has one channel. An upload is answered when the tick's
sample is in the dictionary, so that it and the tick's TPDOs show the same one. A new initiate
request replaces an unfinished transfer: its client has given up on it.
"""

import struct
from dataclasses import dataclass, field

from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.frame import Frame

SDO_SERVER_PARAMETER = 0x1200
TIMEOUT_NS = 1_000_000_000
"""CiA 301 leaves the time-out open; one second is customary (assumed)."""
MAX_DOWNLOAD = 65_536
"""Longest string or DOMAIN a client may write, in bytes (assumed)."""

_HEAD = struct.Struct("<BHB")
_ABORT = struct.Struct("<BHBI")
_EXPEDITED, _SIZE_INDICATED, _TOGGLE, _LAST = 0x02, 0x01, 0x10, 0x01
_SEGMENT = 7


@dataclass(slots=True)
class _Transfer:
    """A segmented transfer under way; `data` holds what has been moved, or is left to move."""

    index: int
    subindex: int
    upload: bool
    data: bytearray = field(default_factory=bytearray)
    size: int | None = None
    toggle: int = 0


class SdoServer:
    """Answers the requests of one SDO client.

    Args:
        dictionary: what is read and written.
        node_id: gives the identifiers where 0x1200 is absent.

    Attributes:
        request_can_id: identifier of the client's requests.

    """

    def __init__(self, dictionary: Dictionary, node_id: int) -> None:
        self._dictionary = dictionary
        request = dictionary.get(SDO_SERVER_PARAMETER, 1)
        answer = dictionary.get(SDO_SERVER_PARAMETER, 2)
        self.request_can_id = (0x600 + node_id if request is None else request.value) & 0x7FF
        self._answer_can_id = (0x580 + node_id if answer is None else answer.value) & 0x7FF
        self.reset()

    def reset(self) -> None:
        """Drop the transfer under way and all answers not yet sent."""
        self._transfer: _Transfer | None = None
        self._upload: tuple[int, int] | None = None
        self._answers: list[bytes] = []
        self._last_ns = 0

    def request(self, now_ns: int, data: bytes) -> None:
        """Take a request; anything but eight bytes is no SDO and is ignored."""
        if len(data) != 8:
            return
        self._answer_upload()
        self._last_ns = now_ns
        _, index, subindex = _HEAD.unpack_from(data)
        if self._transfer is not None and data[0] >> 5 in (0, 3):
            index, subindex = self._transfer.index, self._transfer.subindex
        try:
            self._dispatch(data, index, subindex)
        except SdoAbort as abort:
            self._abort(index, subindex, abort.code)

    def publish(self, now_ns: int, frames: list[Frame]) -> None:
        """Append the answers, or the abort of a transfer whose client went silent."""
        self._answer_upload()
        transfer = self._transfer
        if transfer is not None and now_ns - self._last_ns >= TIMEOUT_NS:
            self._abort(transfer.index, transfer.subindex, AbortCode.TIMED_OUT)
        if self._answers:
            frames.extend([Frame(self._answer_can_id, answer) for answer in self._answers])
            self._answers.clear()

    def _dispatch(self, data: bytes, index: int, subindex: int) -> None:
        match data[0] >> 5:
            case 0:
                self._download_segment(data)
            case 1:
                self._initiate_download(data, index, subindex)
            case 2:
                self._initiate_upload(index, subindex)
            case 3:
                self._upload_segment(data)
            case 4:
                self._transfer = None
            case _:
                raise SdoAbort(AbortCode.UNKNOWN_COMMAND)

    def _initiate_download(self, data: bytes, index: int, subindex: int) -> None:
        self._transfer = None
        kind = self._dictionary.writable(index, subindex).type
        if data[0] & _EXPEDITED:
            size = 4 - (data[0] >> 2 & 3) if data[0] & _SIZE_INDICATED else kind.size or 4
            self._dictionary.download(index, subindex, data[4 : 4 + size])
        else:
            size_indicated = data[0] & _SIZE_INDICATED
            size_or_none = int.from_bytes(data[4:], "little") if size_indicated else None
            if size_or_none is not None:
                kind.check_length(size_or_none)
            self._transfer = _Transfer(index, subindex, upload=False, size=size_or_none)
        self._answers.append(_HEAD.pack(0x60, index, subindex) + bytes(4))

    def _download_segment(self, data: bytes) -> None:
        transfer = self._expect(upload=False, toggle=data[0] & _TOGGLE)
        transfer.data += data[1 : 8 - (data[0] >> 1 & 7)]
        kind = self._dictionary.entry(transfer.index, transfer.subindex).type
        limit = kind.size or MAX_DOWNLOAD
        if len(transfer.data) > limit:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH if kind.size else AbortCode.OUT_OF_MEMORY)
        if data[0] & _LAST:
            if transfer.size is not None and transfer.size != len(transfer.data):
                raise SdoAbort(AbortCode.LENGTH_MISMATCH)
            self._dictionary.download(transfer.index, transfer.subindex, bytes(transfer.data))
            self._transfer = None
        self._answers.append(bytes([0x20 | transfer.toggle]) + bytes(7))
        transfer.toggle ^= _TOGGLE

    def _initiate_upload(self, index: int, subindex: int) -> None:
        self._transfer = None
        self._dictionary.read(index, subindex)
        self._upload = index, subindex

    def _answer_upload(self) -> None:
        """Answer the initiate of an upload with the value the object has by now."""
        if self._upload is None:
            return
        index, subindex = self._upload
        self._upload = None
        try:
            data = self._dictionary.upload(index, subindex)
        except SdoAbort as abort:
            self._abort(index, subindex, abort.code)
            return
        if 1 <= len(data) <= 4:
            head = 0x40 | (4 - len(data)) << 2 | _EXPEDITED | _SIZE_INDICATED
            self._answers.append(_HEAD.pack(head, index, subindex) + data.ljust(4, b"\0"))
        else:
            self._transfer = _Transfer(index, subindex, upload=True, data=bytearray(data))
            head = 0x40 | _SIZE_INDICATED
            self._answers.append(_ABORT.pack(head, index, subindex, len(data)))

    def _upload_segment(self, data: bytes) -> None:
        transfer = self._expect(upload=True, toggle=data[0] & _TOGGLE)
        segment = bytes(transfer.data[:_SEGMENT])
        del transfer.data[:_SEGMENT]
        head = transfer.toggle | (_SEGMENT - len(segment)) << 1
        if not transfer.data:
            head |= _LAST
            self._transfer = None
        self._answers.append(bytes([head]) + segment.ljust(_SEGMENT, b"\0"))
        transfer.toggle ^= _TOGGLE

    def _expect(self, *, upload: bool, toggle: int) -> _Transfer:
        """Return the transfer a segment belongs to (0504 0001, 0503 0000)."""
        transfer = self._transfer
        if transfer is None or transfer.upload is not upload:
            raise SdoAbort(AbortCode.UNKNOWN_COMMAND)
        if toggle != transfer.toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT_NOT_ALTERNATED)
        return transfer

    def _abort(self, index: int, subindex: int, code: AbortCode) -> None:
        self._transfer = None
        self._answers.append(_ABORT.pack(0x80, index, subindex, code))
