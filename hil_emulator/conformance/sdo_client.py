"""An SDO client that can also violate the protocol (CiA 301 7.2.4).

It is written from the specification and shares no code with the device's server. It waits in the
time of the suite.
"""

from binascii import crc_hqx

from hil_emulator.conformance.wire import Wire

SEGMENT = 7
BLOCK = 127

_ABORT = 0x80


class Aborted(Exception):  # noqa: N818 - CiA 301 calls it an abort
    """The device aborted a transfer."""

    def __init__(self, code: int) -> None:
        super().__init__(f"abort {code:08X}")
        self.code = code


class SdoClient:
    """A client of one SDO server.

    Args:
        wire: the suite's connection to the bus.
        request_id: identifier of its requests.
        answer_id: identifier of the answers.

    """

    def __init__(self, wire: Wire, request_id: int, answer_id: int) -> None:
        self._wire = wire
        self._request_id = request_id
        self._answer_id = answer_id

    def send(self, data: bytes) -> int:
        """Send a request; return the position of its answer in the wire's log."""
        since = len(self._wire.log)
        self._wire.send(self._request_id, data.ljust(8, b"\0"))
        return since

    def request(self, data: bytes) -> bytes:
        """Send a request and return the answer.

        Raises:
            Aborted: the answer is an abort.
            AssertionError: there is no answer.

        """
        return self._answer(self.send(data), data)

    def aborts(self, data: bytes) -> int:
        """Send a request and return the abort code of the answer, 0 for any other answer."""
        try:
            self.request(data)
        except Aborted as abort:
            return abort.code
        return 0

    def abort(self, index: int, subindex: int) -> None:
        """End a transfer under way."""
        self.send(head(_ABORT, index, subindex) + (0x0800_0000).to_bytes(4, "little"))

    # -- uploads --------------------------------------------------------------------------

    def upload(self, index: int, subindex: int = 0) -> bytes:
        """Read an object; raises `Aborted`."""
        answer = self.initiate_upload(index, subindex)
        if answer[0] & 0x02:
            return answer[4 : 8 - (answer[0] >> 2 & 3)] if answer[0] & 1 else answer[4:]
        data = self.upload_segments()
        if answer[0] & 0x01:
            announced = int.from_bytes(answer[4:], "little")
            assert announced == len(data), f"announced {announced} bytes, sent {len(data)}"
        return data

    def initiate_upload(self, index: int, subindex: int = 0) -> bytes:
        """Return the answer to the first request of an upload."""
        answer = self.request(head(0x40, index, subindex))
        assert answer[0] & 0xE0 == 0x40, f"answer {answer.hex()} does not answer an upload"
        assert answer[1:4] == head(0, index, subindex)[1:], (
            f"answer {answer.hex()} names another object"
        )
        return answer

    def upload_segments(self) -> bytes:
        """Return the data of the segments of an initiated upload."""
        data, toggle = b"", 0
        while True:
            answer = self.request(bytes([0x60 | toggle]))
            assert answer[0] & 0xF0 == toggle, f"answer {answer.hex()} has the wrong toggle bit"
            data += answer[1 : 8 - (answer[0] >> 1 & 7)]
            if answer[0] & 1:
                return data
            toggle ^= 0x10

    def block_upload(
        self, index: int, subindex: int = 0, *, checked: bool, block_size: int = BLOCK
    ) -> bytes:
        """Read an object as a block and check its checksum; raises `Aborted`."""
        answer = self.initiate_block_upload(index, subindex, block_size, checked=checked)
        data, since = b"", self.send(bytes([0xA3]))
        while True:
            segments = self._block(since, block_size)
            data += b"".join(segment[1:] for segment in segments)
            since = self.send(bytes([0xA2, len(segments), block_size]))
            if segments[-1][0] & 0x80:
                break
        end = self._answer(since, b"end of block")
        assert end[0] & 0xE3 == 0xC1, f"answer {end.hex()} does not end a block upload"
        data = data[: len(data) - (end[0] >> 2 & 7)]
        if checked and answer[0] & 0x04:
            assert int.from_bytes(end[1:3], "little") == crc_hqx(data, 0), "wrong checksum"
        if answer[0] & 0x02:
            assert int.from_bytes(answer[4:], "little") == len(data), "wrong size announced"
        self.send(bytes([0xA1]))
        return data

    def initiate_block_upload(
        self, index: int, subindex: int, block_size: int, *, checked: bool
    ) -> bytes:
        """Return the answer to the first request of a block upload."""
        request = head(0xA4 if checked else 0xA0, index, subindex)
        answer = self.request(request + bytes([block_size, 0]))
        assert answer[0] & 0xE1 == 0xC0, f"answer {answer.hex()} does not start a block upload"
        return answer

    def _block(self, since: int, block_size: int) -> list[bytes]:
        """Return the segments of a block, which must come in sequence."""
        segments: list[bytes] = []
        while len(segments) < block_size and not (segments and segments[-1][0] & 0x80):
            number = len(segments) + 1
            # A first byte of 0x80 is an abort, because segments are numbered from 1.
            segment = self._wire.await_frame(
                self._answer_id,
                lambda data, number=number: data[0] in (number, number | 0x80, _ABORT),  # type: ignore[misc]
                since=since,
            )
            assert segment is not None, f"segment {number} of a block is missing"
            _raise_abort(segment)
            segments.append(segment)
        return segments

    # -- downloads ------------------------------------------------------------------------

    def download(self, index: int, subindex: int, data: bytes, *, segmented: bool = False) -> None:
        """Write an object; raises `Aborted`."""
        if 1 <= len(data) <= 4 and not segmented:
            command = 0x23 | (4 - len(data)) << 2
            self.request(head(command, index, subindex) + data)
            return
        self.request(head(0x21, index, subindex) + len(data).to_bytes(4, "little"))
        toggle = 0
        for at in range(0, max(len(data), 1), SEGMENT):
            segment = data[at : at + SEGMENT]
            last = at + SEGMENT >= len(data)
            answer = self.request(bytes([toggle | (SEGMENT - len(segment)) << 1 | last]) + segment)
            assert answer[0] == 0x20 | toggle, f"answer {answer.hex()} does not answer a segment"
            toggle ^= 0x10

    def segmented_download_code(self, index: int, subindex: int, data: bytes) -> int:
        """Return the abort code of a download in one segment without a size, 0 if accepted."""
        unused = SEGMENT - len(data)
        try:
            self.request(head(0x20, index, subindex))
            self.request(bytes([unused << 1 | 1]) + data)
        except Aborted as abort:
            return abort.code
        return 0

    def block_download(self, index: int, subindex: int, data: bytes, *, checked: bool) -> None:
        """Write an object as a block; raises `Aborted`."""
        request = head(0xC6 if checked else 0xC2, index, subindex)
        answer = self.request(request + len(data).to_bytes(4, "little"))
        assert answer[0] & 0xE3 == 0xA0, f"answer {answer.hex()} does not start a block download"
        at, block_size = 0, answer[4]
        while at < len(data):
            segments = [
                data[n : n + SEGMENT]
                for n in range(at, min(at + SEGMENT * block_size, len(data)), SEGMENT)
            ]
            last = at + SEGMENT * len(segments) >= len(data)
            for number, segment in enumerate(segments, start=1):
                final = 0x80 if last and number == len(segments) else 0
                since = self.send(bytes([number | final]) + segment)
            answer = self._answer(since, b"block")
            assert answer[0] == 0xA2, f"answer {answer.hex()} does not acknowledge a block"
            at += SEGMENT * answer[1]
            block_size = answer[2]
        padding = -len(data) % SEGMENT
        checksum = crc_hqx(data, 0) if checked else 0
        answer = self.request(bytes([0xC1 | padding << 2]) + checksum.to_bytes(2, "little"))
        assert answer[0] == 0xA1, f"answer {answer.hex()} does not end a block download"

    # -- numbers --------------------------------------------------------------------------

    def read(self, index: int, subindex: int = 0) -> int:
        """Return an object as an unsigned number."""
        return int.from_bytes(self.upload(index, subindex), "little")

    def write(self, index: int, subindex: int, value: int, length: int) -> None:
        """Write an unsigned number of `length` bytes."""
        self.download(index, subindex, value.to_bytes(length, "little"))

    def read_code(self, index: int, subindex: int = 0) -> int:
        """Return the abort code of reading an object, 0 for success."""
        try:
            self.upload(index, subindex)
        except Aborted as abort:
            return abort.code
        return 0

    def write_code(self, index: int, subindex: int, data: bytes) -> int:
        """Return the abort code of writing an object, 0 for success."""
        try:
            self.download(index, subindex, data)
        except Aborted as abort:
            return abort.code
        return 0

    def _answer(self, since: int, request: bytes) -> bytes:
        answer = self._wire.await_frame(self._answer_id, since=since)
        assert answer is not None, f"no answer to the SDO request {request.hex()}"
        assert len(answer) == 8, f"answer {answer.hex()} to an SDO request has not eight bytes"
        _raise_abort(answer)
        return answer


def head(command: int, index: int, subindex: int) -> bytes:
    """Return the first four bytes of a request: command, index and sub-index."""
    return bytes([command]) + index.to_bytes(2, "little") + bytes([subindex])


def _raise_abort(answer: bytes) -> None:
    if answer[0] == _ABORT:
        raise Aborted(int.from_bytes(answer[4:], "little"))
