"""Chapter 6, additional cases: wrong SYNC messages, and the SYNC producer (CiA 301 7.2.5)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_object, need_writable
from hil_emulator.conformance.device import (
    EMCY_COB_ID,
    OPERATIONAL,
    STOPPED,
    SYNC_COB_ID,
    SYNC_OVERFLOW,
    Device,
)
from hil_emulator.conformance.errors import SYNC_LENGTH
from hil_emulator.conformance.situations import SYNC
from hil_emulator.conformance.test_sync import OTHER_SYNC, PRODUCE, produces, synchronous

OVERFLOW = 10
WATCH_MS = 250


def producing(device: Device) -> None:
    """Switch the SYNC producer on; skip the case for a device without a SYNC producer."""
    if not produces(device):
        pytest.skip("the device produces no SYNC")


@case("6.301")
def test_wrong_length_is_reported(device: Device) -> None:
    """A SYNC with a byte too many, or without its counter, causes only an emergency 8240."""
    need_object(device, SYNC_COB_ID)
    need_object(device, EMCY_COB_ID)
    overflows = (0, OVERFLOW) if device.eds.writable(SYNC_OVERFLOW) else (0,)
    for overflow in overflows:
        device.reset()
        pdo = synchronous(device, overflow)[0]
        can_id = pdo.can_id
        device.enter(OPERATIONAL)
        since = len(device.wire.log)
        device.wire.send(SYNC, b"" if overflow else b"\x01")
        assert device.await_emergency(SYNC_LENGTH, since) is not None, "no emergency 8240"
        device.barrier()
        assert device.wire.heard(can_id, since) == [], "a TPDO"


@case("6.302")
def test_stopped_produces_no_sync(device: Device) -> None:
    """A producer sends no SYNC in STOPPED."""
    producing(device)
    device.enter(OPERATIONAL)
    device.enter(STOPPED)
    since = len(device.wire.log)
    device.wire.run(WATCH_MS)
    assert device.wire.heard(SYNC, since) == []


@case("6.303")
def test_identifier_of_a_producer_is_locked(device: Device) -> None:
    """While bit 30 of 0x1005 is set, the identifier cannot be changed."""
    producing(device)
    code = device.sdo.write_code(SYNC_COB_ID, 0, (PRODUCE | OTHER_SYNC).to_bytes(4, "little"))
    assert code, "the identifier was changed"
    assert device.sdo.read(SYNC_COB_ID) & 0x7FF == SYNC


@case("6.304")
def test_counter_begins_with_one(device: Device) -> None:
    """A producer starts its counter at 1 each time it is switched on."""
    need_writable(device, SYNC_OVERFLOW)
    for _ in range(2):
        device.prepare_sync(overflow=OVERFLOW)
        since = len(device.wire.log)
        producing(device)
        device.wire.run(WATCH_MS)
        counters = [data[:1] for data in device.wire.heard(SYNC, since)]
        assert counters[:2] == [b"\x01", b"\x02"], f"the counter began with {counters[:2]}"


@case("6.305")
def test_sync_stops_when_switched_off(device: Device) -> None:
    """With bit 30 of 0x1005 cleared the producer sends no further SYNC."""
    producing(device)
    device.wire.run(WATCH_MS)
    device.sdo.write(SYNC_COB_ID, 0, SYNC, 4)
    device.barrier()
    since = len(device.wire.log)
    device.wire.run(WATCH_MS)
    assert device.wire.heard(SYNC, since) == []
