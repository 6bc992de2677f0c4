"""Chapter 2, third part: block transfers (CiA 301 7.2.4.3.8 to 7.2.4.3.16)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_writable
from hil_emulator.conformance.device import GUARD_TIME, HEARTBEAT_PRODUCER, Device
from hil_emulator.conformance.sdo_client import BLOCK, Aborted, head
from hil_emulator.conformance.test_sdo_segmented import long_object, time_ms

PAUSE_MS = 10
NO_BLOCK_TRANSFER = 0x0504_0001
BLOCK_UPLOAD, BLOCK_ANSWER = 0xA0, 0xC0
"""Command specifiers of a block upload and of the answer to it (CiA 301 7.2.4.3.11)."""
BLOCK_DOWNLOAD_CHECKED, CHECKSUM_SUPPORTED = 0xC6, 0x04
"""A block download with checksum and size, and the bit of an answer (CiA 301 7.2.4.3.8)."""
WRONG_BLOCK_SIZE = {0x0504_0001, 0x0504_0002, 0x0800_0000}
WRONG_SEQUENCE_NUMBER = {0x0504_0001, 0x0504_0003, 0x0800_0000}


def need_block_transfer(device: Device) -> None:
    """Skip the case if the device has no block transfer, which is optional."""
    if not offers_block_transfer(device):
        pytest.skip("the device has no SDO block transfer")


def offers_block_transfer(device: Device) -> bool:
    """Return whether the device starts a block transfer, even if other details are wrong."""
    request = head(BLOCK_UPLOAD, 0x1000, 0) + bytes([BLOCK])
    try:
        answer = device.sdo.request(request)
    except Aborted as abort:
        return abort.code != NO_BLOCK_TRANSFER
    device.sdo.abort(0x1000, 0)
    device.wire.run(PAUSE_MS)  # ignores an answer to the abort, which case 2.304 checks
    return answer[0] & BLOCK_ANSWER == BLOCK_ANSWER


def need_checksum(device: Device, index: int, size: int) -> None:
    """Skip the case if the device computes no checksum of a block, which is optional."""
    request = head(BLOCK_DOWNLOAD_CHECKED, index, 0) + size.to_bytes(4, "little")
    answer = device.sdo.request(request)
    device.sdo.abort(index, 0)
    device.wire.run(PAUSE_MS)
    if not answer[0] & CHECKSUM_SUPPORTED:
        pytest.skip("the device supports no checksum")


def takes_block(device: Device, index: int, *, checked: bool) -> None:
    """Check that an object can be written as a block and has the value written."""
    need_writable(device, index)
    need_block_transfer(device)
    value = time_ms(device, index)
    if checked:
        need_checksum(device, index, len(value))
    device.sdo.block_download(index, 0, value, checked=checked)
    assert device.sdo.upload(index) == value


@case("2.19")
def test_device_type_is_uploaded_as_a_block(device: Device) -> None:
    """A block of one segment has the same data as an expedited read.

    A device without block transfer aborts the request and does not start another transfer.
    """
    if not offers_block_transfer(device):
        code = device.sdo.aborts(head(BLOCK_UPLOAD, 0x1000, 0) + bytes([BLOCK]))
        assert code == NO_BLOCK_TRANSFER, "a block upload was answered as another transfer"
        pytest.skip("the device has no SDO block transfer")
    assert device.sdo.block_upload(0x1000, checked=False) == device.sdo.upload(0x1000)


@case("2.20")
def test_guard_time_is_taken_as_a_block(device: Device) -> None:
    """0x100C, written as a block, has the value written."""
    takes_block(device, GUARD_TIME, checked=False)


@case("2.21")
def test_heartbeat_time_is_taken_as_a_block(device: Device) -> None:
    """0x1017, written as a block, has the value written."""
    takes_block(device, HEARTBEAT_PRODUCER, checked=False)


@case("2.22")
def test_string_is_uploaded_as_a_block(device: Device) -> None:
    """In blocks of two segments, an object of several segments is complete."""
    need_block_transfer(device)
    key = long_object(device)
    assert device.sdo.block_upload(*key, checked=False, block_size=2) == device.sdo.upload(*key)


@case("2.23")
def test_block_upload_has_a_checksum(device: Device) -> None:
    """The checksum of the end message matches the data."""
    need_block_transfer(device)
    key = long_object(device)
    assert device.sdo.block_upload(*key, checked=True) == device.sdo.upload(*key)


@case("2.24")
def test_guard_time_is_taken_as_a_checked_block(device: Device) -> None:
    """0x100C, written as a block with a checksum, has the value written."""
    takes_block(device, GUARD_TIME, checked=True)


@case("2.25")
def test_heartbeat_time_is_taken_as_a_checked_block(device: Device) -> None:
    """0x1017, written as a block with a checksum, has the value written."""
    takes_block(device, HEARTBEAT_PRODUCER, checked=True)


@case("2.26")
def test_block_size_of_128_is_refused(device: Device) -> None:
    """A block size of 128 is refused, at the start and in the course of an upload."""
    need_block_transfer(device)
    assert device.sdo.aborts(bytes.fromhex("a0001000 8000")) in WRONG_BLOCK_SIZE
    device.sdo.initiate_block_upload(0x1000, 0, BLOCK, checked=False)
    device.sdo.request(bytes([0xA3]))
    assert device.sdo.aborts(bytes([0xA2, 1, BLOCK + 1])) in WRONG_BLOCK_SIZE
    assert device.sdo.read_code(0x1000) == 0


@case("2.27")
def test_acknowledgement_of_segment_128_is_refused(device: Device) -> None:
    """The acknowledgement of a segment that was not sent is refused."""
    need_block_transfer(device)
    device.sdo.initiate_block_upload(0x1000, 0, BLOCK, checked=False)
    device.sdo.request(bytes([0xA3]))
    assert device.sdo.aborts(bytes([0xA2, BLOCK + 1, BLOCK])) in WRONG_SEQUENCE_NUMBER
    assert device.sdo.read_code(0x1000) == 0
