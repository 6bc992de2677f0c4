"""Chapter 2, second part: segmented transfers (CiA 301 7.2.4.3.3 to 7.2.4.3.7)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_writable
from hil_emulator.conformance.device import GUARD_TIME, HEARTBEAT_PRODUCER, Device
from hil_emulator.conformance.expectation import where
from hil_emulator.conformance.parameters import strings
from hil_emulator.conformance.sdo_client import SEGMENT

TOGGLE_NOT_ALTERNATED = {0x0503_0000}
OUT_OF_SEQUENCE = {0x0504_0001, 0x0800_0000}
WRONG_LENGTH = {0x0607_0010, 0x0607_0012, 0x0607_0013, 0x0504_0005, 0x0800_0000}
TIME_MS = 60_000


def long_object(device: Device, more_than: int = 4) -> tuple[int, int]:
    """Return an object of more than `more_than` bytes, which the device sends in segments."""
    for variable in strings(device.eds):
        key = variable.index, variable.subindex
        if device.sdo.read_code(*key) == 0 and len(device.sdo.upload(*key)) > more_than:
            return key
    pytest.skip(f"the device has no object of more than {more_than} bytes")


def time_ms(device: Device, index: int) -> bytes:
    """Return a minute in ms, or the object's upper limit if that is lower."""
    return device.eds.limited(index, TIME_MS).to_bytes(2, "little")


def takes_segmented(device: Device, index: int) -> None:
    """Check that an object can be written in segments and has the value written."""
    need_writable(device, index)
    value = time_ms(device, index)
    device.sdo.download(index, 0, value, segmented=True)
    assert device.sdo.upload(index) == value


@case("2.13")
def test_no_segment_follows_an_expedited_answer(device: Device) -> None:
    """After a read of the device type, expedited or segmented, a request for a segment aborts."""
    device.sdo.upload(0x1000)
    assert device.sdo.aborts(bytes([0x60])) in OUT_OF_SEQUENCE


@case("2.14")
def test_guard_time_is_taken_in_segments(device: Device) -> None:
    """0x100C, written in one segment, has the value written."""
    takes_segmented(device, GUARD_TIME)


@case("2.15")
def test_heartbeat_time_is_taken_in_segments(device: Device) -> None:
    """0x1017, written in one segment, has the value written."""
    takes_segmented(device, HEARTBEAT_PRODUCER)


@case("2.16")
def test_segmented_upload_announces_its_size(device: Device) -> None:
    """The size in the first answer is the length of the segments' data."""
    answer = device.sdo.initiate_upload(*long_object(device))
    assert answer[0] == 0x41, f"{answer.hex()} indicates no size"
    assert len(device.sdo.upload_segments()) == int.from_bytes(answer[4:], "little") > 4


@case("2.17")
def test_toggle_bit_has_to_toggle(device: Device) -> None:
    """A first request for a segment with the toggle bit set aborts the transfer."""
    key = long_object(device)
    device.sdo.initiate_upload(*key)
    assert device.sdo.aborts(bytes([0x70])) in TOGGLE_NOT_ALTERNATED
    assert device.sdo.aborts(bytes([0x60])) in OUT_OF_SEQUENCE
    assert device.sdo.read_code(*key) == 0


@case("2.18")
def test_long_objects_are_uploaded_in_segments(device: Device) -> None:
    """Every string has the value of the EDS, or the same value in two reads without a default."""
    long_object(device)
    for variable in strings(device.eds):
        key = variable.index, variable.subindex
        if variable.type.numeric or device.sdo.read_code(*key):
            continue
        expected = device.eds.default(variable) if variable.access == "const" else None
        data = device.sdo.upload(*key)
        assert data == (expected or device.sdo.upload(*key)), where(variable)


@case("2.314")
def test_segments_have_the_length_of_the_object(device: Device) -> None:
    """A download without a size is aborted if it has more or fewer bytes than its object."""
    need_writable(device, HEARTBEAT_PRODUCER)
    before = device.sdo.upload(HEARTBEAT_PRODUCER)
    for size in (1, 3, SEGMENT):
        code = device.sdo.segmented_download_code(HEARTBEAT_PRODUCER, 0, bytes(size))
        assert code in WRONG_LENGTH, f"{size} bytes for 2 end with {code:08X}"
        assert device.sdo.upload(HEARTBEAT_PRODUCER) == before


@case("2.317")
def test_no_segment_follows_the_last(device: Device) -> None:
    """After the last segment of an upload a further request aborts."""
    device.sdo.initiate_upload(*long_object(device))
    toggle = 0x10 * (len(device.sdo.upload_segments()) // SEGMENT % 2)
    assert device.sdo.aborts(bytes([0x60 | toggle ^ 0x10])) in OUT_OF_SEQUENCE
