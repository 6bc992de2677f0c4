"""Chapter 2, third part: block transfers (CiA 301 7.2.4.3.8 to 7.2.4.3.16)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_writable
from hil_emulator.conformance.device import GUARD_TIME, HEARTBEAT_PRODUCER, Device
from hil_emulator.conformance.sdo_client import BLOCK, Aborted
from hil_emulator.conformance.test_sdo_segmented import long_object, time_ms

NO_BLOCK_TRANSFER = 0x0504_0001
WRONG_BLOCK_SIZE = {0x0504_0001, 0x0504_0002, 0x0800_0000}
WRONG_SEQUENCE_NUMBER = {0x0504_0001, 0x0504_0003, 0x0800_0000}


def need_block_transfer(device: Device) -> None:
    """Skip the case where the device knows no block transfer, which is optional."""
    try:
        device.sdo.initiate_block_upload(0x1000, 0, BLOCK, checked=False)
    except Aborted as abort:
        if abort.code == NO_BLOCK_TRANSFER:
            pytest.skip("the device has no SDO block transfer")
        raise
    device.sdo.abort(0x1000, 0)


def takes_block(device: Device, index: int, *, checked: bool) -> None:
    """Check that an object can be written as a block and holds what was written."""
    need_writable(device, index)
    need_block_transfer(device)
    value = time_ms(device, index)
    device.sdo.block_download(index, 0, value, checked=checked)
    assert device.sdo.upload(index) == value


@case("2.19")
def test_device_type_is_uploaded_as_a_block(device: Device) -> None:
    """A block of one segment holds what an expedited read does."""
    need_block_transfer(device)
    assert device.sdo.block_upload(0x1000, checked=False) == device.sdo.upload(0x1000)


@case("2.20")
def test_guard_time_is_taken_as_a_block(device: Device) -> None:
    """0x100C, written as a block, reads back."""
    takes_block(device, GUARD_TIME, checked=False)


@case("2.21")
def test_heartbeat_time_is_taken_as_a_block(device: Device) -> None:
    """0x1017, written as a block, reads back."""
    takes_block(device, HEARTBEAT_PRODUCER, checked=False)


@case("2.22")
def test_string_is_uploaded_as_a_block(device: Device) -> None:
    """In blocks of two segments, an object of several segments comes whole."""
    need_block_transfer(device)
    key = long_object(device)
    assert device.sdo.block_upload(*key, checked=False, block_size=2) == device.sdo.upload(*key)


@case("2.23")
def test_block_upload_has_a_checksum(device: Device) -> None:
    """The checksum of the end is that of the data."""
    need_block_transfer(device)
    key = long_object(device)
    assert device.sdo.block_upload(*key, checked=True) == device.sdo.upload(*key)


@case("2.24")
def test_guard_time_is_taken_as_a_checked_block(device: Device) -> None:
    """0x100C, written as a block with a checksum, reads back."""
    takes_block(device, GUARD_TIME, checked=True)


@case("2.25")
def test_heartbeat_time_is_taken_as_a_checked_block(device: Device) -> None:
    """0x1017, written as a block with a checksum, reads back."""
    takes_block(device, HEARTBEAT_PRODUCER, checked=True)


@case("2.26")
def test_block_size_of_128_is_refused(device: Device) -> None:
    """A block has 127 segments at most, at the beginning of an upload as later on."""
    need_block_transfer(device)
    assert device.sdo.aborts(bytes.fromhex("a0001000 8000")) in WRONG_BLOCK_SIZE
    device.sdo.initiate_block_upload(0x1000, 0, BLOCK, checked=False)
    device.sdo.request(bytes([0xA3]))
    assert device.sdo.aborts(bytes([0xA2, 1, BLOCK + 1])) in WRONG_BLOCK_SIZE
    assert device.sdo.read_code(0x1000) == 0


@case("2.27")
def test_acknowledgement_of_segment_128_is_refused(device: Device) -> None:
    """Nobody can have received a segment that was not sent."""
    need_block_transfer(device)
    device.sdo.initiate_block_upload(0x1000, 0, BLOCK, checked=False)
    device.sdo.request(bytes([0xA3]))
    assert device.sdo.aborts(bytes([0xA2, BLOCK + 1, BLOCK])) in WRONG_SEQUENCE_NUMBER
    assert device.sdo.read_code(0x1000) == 0
