"""Chapter 6: SYNC (CiA 301 7.2.5, 7.5.2.5 to 7.5.2.7, 7.5.2.22)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_object, need_sync, need_writable
from hil_emulator.conformance.device import (
    CYCLE_PERIOD,
    OPERATIONAL,
    SAVE,
    STORE_PARAMETERS,
    SYNC_COB_ID,
    SYNC_OVERFLOW,
    Device,
)
from hil_emulator.conformance.pdo import Pdo, usable
from hil_emulator.conformance.situations import EVERY, SYNC, check_rate

WINDOW = 0x1007
PRODUCE = 1 << 30
CANNOT_PRODUCE = {0x0609_0030, 0x0800_0000, 0x0601_0002}
INVALID_VALUE = {0x0609_0030, 0x0609_0031, 0x0609_0032, 0x0800_0000}
LOCKED = {0x0800_0022, 0x0800_0000}
SYNC_LENGTH_ERROR = 0x8240
PERIOD_US = 20_000
OTHER_SYNC = 0x6D0
"""Identifier that is not restricted and not in the predefined connection set."""
WATCH_MS = 500
SYNCS = 5


def produces(device: Device) -> bool:
    """Switch the SYNC producer on; return whether the device has a SYNC producer."""
    if not (device.eds.writable(SYNC_COB_ID) and device.eds.writable(CYCLE_PERIOD)):
        return False
    device.sdo.write(CYCLE_PERIOD, 0, PERIOD_US, 4)
    code = device.sdo.write_code(SYNC_COB_ID, 0, (PRODUCE | SYNC).to_bytes(4, "little"))
    assert code == 0 or code in CANNOT_PRODUCE, f"bit 30 of 1005 ends with {code:08X}"
    return code == 0


def synchronous(device: Device, overflow: int = 0) -> list[Pdo]:
    """Return the TPDOs, all sent at every SYNC, with this overflow of the SYNC counter."""
    need_sync(device)
    tpdos = usable(device, overflow)
    for pdo in tpdos:
        pdo.configure(EVERY)
        pdo.enable()
    return tpdos


def check_answered(device: Device, pdos: list[Pdo], counters: list[int | None], sync: int) -> None:
    """Check that each SYNC triggers each TPDO once, and no emergency."""
    identifiers = [pdo.can_id for pdo in pdos]
    device.enter(OPERATIONAL)
    since = len(device.wire.log)
    for counter in counters:
        device.sync(counter, sync)
    device.wire.run(20)
    for can_id in identifiers:
        count = len(device.wire.heard(can_id, since))
        assert count == len(counters), f"{can_id:03X}: {count} for {len(counters)} SYNC"
    assert SYNC_LENGTH_ERROR not in device.emergencies(since)


@case("6.1")
def test_predefined_sync_is_consumed(device: Device) -> None:
    """0x1005 is 0x80 by default, as in the EDS."""
    need_object(device, SYNC_COB_ID)
    value = device.sdo.upload(SYNC_COB_ID)
    assert value == device.eds.default(device.eds.variables[SYNC_COB_ID, 0])
    assert int.from_bytes(value, "little") & 0x7FF == SYNC


@case("6.2")
def test_sync_is_produced_or_not(device: Device) -> None:
    """A producer sends SYNC at its period until it is switched off; other devices refuse."""
    producing = produces(device)
    heard, elapsed_ms = device.wire.watch(SYNC, 3 if producing else 0, WATCH_MS)
    count = len(heard)
    if not producing:
        assert count == 0, f"{count} SYNC from a device that refuses to produce them"
        return
    check_rate(count, elapsed_ms, PERIOD_US / 1000, "cycle period")
    device.sdo.write(SYNC_COB_ID, 0, SYNC, 4)
    device.barrier()
    since = len(device.wire.log)
    device.wire.run(WATCH_MS)
    assert device.wire.heard(SYNC, since) == []


@case("6.3")
def test_every_sync_is_answered(device: Device) -> None:
    """As many TPDOs of type 1 are sent as there are SYNCs."""
    check_answered(device, synchronous(device), [None] * SYNCS, SYNC)


@case("6.4")
def test_consumer_needs_no_period(device: Device) -> None:
    """With 0x1006 = 0, the device sends no SYNC, and consumes the SYNC of others."""
    need_writable(device, SYNC_COB_ID)
    device.sdo.write(SYNC_COB_ID, 0, SYNC, 4)
    since = len(device.wire.log)
    check_answered(device, synchronous(device), [None] * SYNCS, SYNC)
    assert device.wire.heard(SYNC, since) == []


@case("6.5")
def test_invalid_overflow_is_refused(device: Device) -> None:
    """Counter overflow values 1 and 241 to 255 are refused."""
    need_writable(device, SYNC_OVERFLOW)
    device.prepare_sync()
    for value in (1, 241, 255):
        assert device.sdo.write_code(SYNC_OVERFLOW, 0, bytes([value])) in INVALID_VALUE, value
    assert device.sdo.read(SYNC_OVERFLOW) == 0


@case("6.6")
def test_overflow_of_zero_means_no_counter(device: Device) -> None:
    """With 0x1019 = 0, a SYNC without data is accepted."""
    need_writable(device, SYNC_OVERFLOW)
    check_answered(device, synchronous(device), [None] * SYNCS, SYNC)


@case("6.7")
def test_counter_runs_from_one_to_the_overflow(device: Device) -> None:
    """A producer counts 1, 2, 3, 1, ...; a consumer accepts this counter."""
    need_writable(device, SYNC_OVERFLOW)
    device.prepare_sync(overflow=3)
    if not produces(device):
        check_answered(device, synchronous(device, 3), [1, 2, 3, 1, 2], SYNC)
        return
    device.wire.run(WATCH_MS)
    counters = [data[0] for data in device.wire.heard(SYNC) if len(data) == 1]
    assert len(counters) >= 4
    assert counters == [(counters[0] - 1 + n) % 3 + 1 for n in range(len(counters))]


@case("6.8")
def test_overflow_is_kept_over_a_restart(storing: Device) -> None:
    """0x1019, saved, keeps its value over reset node."""
    need_writable(storing, SYNC_OVERFLOW)
    need_writable(storing, STORE_PARAMETERS, 1)
    storing.prepare_sync(overflow=20)
    storing.sdo.download(STORE_PARAMETERS, 1, SAVE)
    storing.reset()
    assert storing.sdo.read(SYNC_OVERFLOW) == 20


@case("6.9")
def test_overflow_is_locked_by_a_period(device: Device) -> None:
    """While 0x1006 is not 0, 0x1019 cannot be changed."""
    need_writable(device, SYNC_OVERFLOW)
    need_writable(device, CYCLE_PERIOD)
    device.prepare_sync()
    device.sdo.write(CYCLE_PERIOD, 0, PERIOD_US, 4)
    assert device.sdo.write_code(SYNC_OVERFLOW, 0, bytes([10])) in LOCKED
    assert device.sdo.read(SYNC_OVERFLOW) == 0


@case("6.10")
def test_sync_parameters_are_kept_over_a_restart(storing: Device) -> None:
    """Saved identifier, period and window are kept over reset node, and the identifier is used."""
    need_writable(storing, SYNC_COB_ID)
    need_writable(storing, STORE_PARAMETERS, 1)
    values = {SYNC_COB_ID: OTHER_SYNC, CYCLE_PERIOD: PERIOD_US, WINDOW: PERIOD_US}
    values = {index: value for index, value in values.items() if storing.eds.writable(index)}
    for index, value in values.items():
        storing.sdo.write(index, 0, value, 4)
    storing.sdo.download(STORE_PARAMETERS, 1, SAVE)
    storing.reset()
    assert {index: storing.sdo.read(index) for index in values} == values
    check_answered(storing, synchronous(storing), [None] * SYNCS, OTHER_SYNC)
