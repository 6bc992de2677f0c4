"""Chapter 2, additional cases: failed transfers do not change the object (CiA 301 7.2.4.3)."""

from binascii import crc_hqx

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import NO_SUCH_OBJECT, need_writable
from hil_emulator.conformance.device import HEARTBEAT_PRODUCER, Device
from hil_emulator.conformance.parameters import APPLICATION, free_parameters, numbers
from hil_emulator.conformance.sdo_client import BLOCK, SEGMENT, SdoClient, head
from hil_emulator.conformance.test_sdo_access import NO_SUCH_SUBINDEX
from hil_emulator.conformance.test_sdo_block import need_block_transfer, offers_block_transfer
from hil_emulator.conformance.test_sdo_segmented import TOGGLE_NOT_ALTERNATED, long_object
from hil_emulator.device.entry import Entry

TIMED_OUT, CRC_ERROR = 0x0504_0000, 0x0504_0004
ABORT = b"\x80"
LENGTH = {0x0607_0010, 0x0607_0012, 0x0607_0013, 0x0800_0000}
OUT_OF_SEQUENCE = {0x0503_0000, 0x0504_0001, 0x0800_0000}
SERVER, TO_SERVER, TO_CLIENT = 0x1201, 1, 2
REQUEST_ID, ANSWER_ID = 0x6C1, 0x6C2
"""Identifiers that are not restricted and not in the predefined connection set (7.3.5)."""
SILENCE_MS = 15_000
"""Longest time-out of a server (assumed)."""
PAUSE_MS = 50
STRUCTURE = 255
"""Sub-index that shows the structure of an object (CiA 301 7.4.6.3)."""


class Written:
    """An object with its value, which a failed download must not change."""

    def __init__(self, device: Device, key: tuple[int, int] = (HEARTBEAT_PRODUCER, 0)) -> None:
        self.device = device
        need_writable(device, *key)
        self.key = key
        self.before = device.sdo.upload(*key)
        self.data = b"\x55\xaa"

    def initiate(self, command: int = 0x21, size: int = 2) -> bytes:
        """Start a download that announces a size; return the answer."""
        request = head(command, *self.key) + size.to_bytes(4, "little")
        return self.device.sdo.request(request)

    def check_untouched(self) -> None:
        """Check that the object is unchanged, and that the server answers."""
        assert self.device.sdo.upload(*self.key) == self.before, "the object has changed"


def loose(device: Device) -> Written:
    """Return an object of variable length if possible: only the announced length limits it."""
    variables = [v for v in free_parameters(device.eds, APPLICATION) if not v.type.numeric]
    keys = [
        (v.index, v.subindex) for v in variables if device.sdo.read_code(v.index, v.subindex) == 0
    ]
    return Written(device, *keys[:1])


def first_number(device: Device, size: int) -> Entry:
    """Return a parameter of `size` bytes that can be written at any time."""
    variables = numbers(device.eds, size)
    if not variables:
        pytest.skip(f"no parameter of {size} bytes can be written")
    return variables[0]


@case("2.301")
def test_size_is_optional(device: Device) -> None:
    """An expedited download with s = 0 has the size of the object."""
    variable = first_number(device, 4)
    value = device.sdo.upload(variable.index, variable.subindex)
    device.sdo.request(head(0x22, variable.index, variable.subindex) + value)
    assert device.sdo.upload(variable.index, variable.subindex) == value


@case("2.302")
def test_answers_name_their_object(device: Device) -> None:
    """Confirmations and aborts carry index and sub-index of the request."""
    variable = first_number(device, 2)
    key = variable.index, variable.subindex
    answer = device.sdo.request(head(0x2B, *key) + device.sdo.upload(*key))
    assert answer[:4] == head(0x60, *key)
    for request in (head(0x40, 0x1000, 1), head(0x23, 0x1000, 0)):
        since = device.sdo.send(request)
        refused = device.wire.await_frame(0x580 + device.node_id, since=since)
        assert refused is not None
        assert refused[:4] == ABORT + request[1:4]


@case("2.303")
def test_download_toggle_has_to_toggle(device: Device) -> None:
    """A first segment with the toggle bit set is aborted and does not change the object."""
    target = Written(device)
    target.initiate()
    assert device.sdo.aborts(b"\x1b" + target.data) in TOGGLE_NOT_ALTERNATED
    target.check_untouched()


@case("2.304")
def test_abort_ends_a_download(device: Device) -> None:
    """The client's abort discards the data received; the abort is not answered."""
    target = Written(device)
    target.initiate()
    device.sdo.request(b"\x0a" + target.data)
    since = len(device.wire.log)
    device.sdo.abort(*target.key)
    device.wire.run(PAUSE_MS)
    assert device.wire.heard(0x580 + device.node_id, since) == [], "an abort was answered"
    assert device.sdo.aborts(b"\x1f") in OUT_OF_SEQUENCE, "the transfer went on"
    target.check_untouched()


@case("2.305")
def test_silent_client_times_out(device: Device) -> None:
    """A download whose client sends no segment is aborted with 0504 0000."""
    target = Written(device)
    target.initiate()
    since = len(device.wire.log)
    answer_id = 0x580 + device.node_id
    abort = device.wire.await_frame(answer_id, since=since, patience_ms=SILENCE_MS)
    assert abort is not None, "the server waits for ever"
    assert abort == head(0x80, *target.key) + TIMED_OUT.to_bytes(4, "little")
    target.check_untouched()


@case("2.306")
def test_segments_have_the_announced_length(device: Device) -> None:
    """One byte is aborted if two bytes were announced."""
    target = loose(device)
    target.initiate()
    assert device.sdo.aborts(b"\x0d" + target.data[:1]) in LENGTH
    target.check_untouched()


@case("2.307")
def test_client_may_restart(device: Device) -> None:
    """A request in the middle of a download is served or aborted, and the download discarded."""
    target = Written(device)
    target.initiate()
    assert device.sdo.read_code(0x1000) in {0, *OUT_OF_SEQUENCE}
    target.check_untouched()


@case("2.308")
def test_additional_server_is_served(device: Device) -> None:
    """The server of 0x1201 answers with its identifiers; without identifiers it does not answer."""
    need_writable(device, SERVER, TO_SERVER)
    need_writable(device, SERVER, TO_CLIENT)
    device.sdo.write(SERVER, TO_SERVER, REQUEST_ID, 4)
    device.sdo.write(SERVER, TO_CLIENT, ANSWER_ID, 4)
    client = SdoClient(device.wire, REQUEST_ID, ANSWER_ID)
    assert client.upload(0x1000) == device.sdo.upload(0x1000)
    device.sdo.write(SERVER, TO_SERVER, 1 << 31 | REQUEST_ID, 4)
    since = client.send(head(0x40, 0x1000, 0))
    device.barrier()
    assert device.wire.heard(ANSWER_ID, since) == []


@case("2.309")
def test_wrong_checksum_is_refused(device: Device) -> None:
    """A block with a wrong checksum is aborted with 0504 0004."""
    target = Written(device)
    need_block_transfer(device)
    if not target.initiate(0xC6)[0] & 0x04:
        device.sdo.abort(*target.key)
        pytest.skip("the device supports no checksum")
    assert device.sdo.request(b"\x81" + target.data)[:2] == b"\xa2\x01"
    wrong = crc_hqx(target.data, 0) ^ 0xFFFF
    assert device.sdo.aborts(b"\xd5" + wrong.to_bytes(2, "little")) == CRC_ERROR
    target.check_untouched()


@case("2.310")
def test_block_has_the_announced_length(device: Device) -> None:
    """One byte is aborted, at the latest at the end, if two bytes were announced."""
    target = loose(device)
    need_block_transfer(device)
    target.initiate(0xC2)
    device.sdo.request(b"\x81" + target.data[:1])
    assert device.sdo.aborts(b"\xd9") in LENGTH
    target.check_untouched()


@case("2.311")
def test_lost_segment_is_requested_again(device: Device) -> None:
    """If the first segment is lost, no segment is acknowledged, and a retry is accepted."""
    target = Written(device)
    need_block_transfer(device)
    target.initiate(0xC2)
    assert device.sdo.request(b"\x82" + target.data)[:2] == b"\xa2\x00", "a gap was acknowledged"
    assert device.sdo.request(b"\x81" + target.data)[:2] == b"\xa2\x01"
    device.sdo.abort(*target.key)
    target.check_untouched()


@case("2.312")
def test_client_sets_the_block_size(device: Device) -> None:
    """Blocks have one segment, then two, as the client requests."""
    need_block_transfer(device)
    key = long_object(device, more_than=2 * SEGMENT)
    data = device.sdo.upload(*key)
    device.sdo.initiate_block_upload(*key, 1, checked=False)
    since = device.sdo.send(b"\xa3")
    for size, request in ((1, bytes([0xA2, 1, 2])), (2, bytes([0xA2, 1, BLOCK]))):
        device.wire.run(PAUSE_MS)
        segments = device.wire.heard(0x580 + device.node_id, since)
        assert len(segments) == size
        assert segments[0][1:] == data[SEGMENT * (size - 1) :][:SEGMENT].ljust(SEGMENT, b"\0")
        since = device.sdo.send(request)
    device.wire.run(PAUSE_MS)
    device.sdo.abort(*key)
    assert device.sdo.read_code(*key) == 0


@case("2.313")
def test_reserved_bytes_are_zero(device: Device) -> None:
    """Unused bytes of the confirmations of downloads are 0."""
    target = Written(device)
    answer = device.sdo.request(head(0x2B, *target.key) + target.before)
    assert answer[4:] == bytes(4), f"download: {answer.hex()}"
    target.initiate()
    answer = device.sdo.request(b"\x0b" + target.before)
    assert answer == b"\x20" + bytes(7), f"segment: {answer.hex()}"
    if offers_block_transfer(device):
        target.initiate(0xC2)
        answer = device.sdo.request(b"\x81" + target.before)
        assert answer[3:] == bytes(5), f"block: {answer.hex()}"
        answer = device.sdo.request(b"\xd5")
        assert answer == b"\xa1" + bytes(7), f"end of block: {answer.hex()}"


@case("2.315")
def test_subindices_end_with_the_last(device: Device) -> None:
    """The sub-index after the last one of each array and record is refused with 0609 0011."""
    for index in device.eds.indices():
        present = [n for i, n in device.eds.variables if i == index and n < STRUCTURE]
        if 1 <= max(present) < STRUCTURE - 1:
            code = device.sdo.read_code(index, max(present) + 1)
            assert code in NO_SUCH_SUBINDEX, f"{index:04X}:{max(present) + 1:02X} {code:08X}"


@case("2.316")
def test_absent_objects_are_not_written(device: Device) -> None:
    """Writing a reserved object aborts with 0602 0000, a sub-index of a variable with 0609 0011."""
    assert device.sdo.write_code(0x1004, 0, bytes(4)) in NO_SUCH_OBJECT
    assert device.sdo.write_code(0x1000, 1, bytes(4)) in NO_SUCH_SUBINDEX
