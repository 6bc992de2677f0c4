"""Chapter 12: TIME (CiA 301 7.2.6, 7.5.2.15)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_object, need_writable
from hil_emulator.conformance.device import Device
from hil_emulator.conformance.wire import NS_PER_MS
from hil_emulator.device.entry import Entry

TIME_COB_ID, TIME = 0x1012, 0x100
CONSUME, PRODUCE = 1 << 31, 1 << 30
LENGTH, MS_PER_DAY = 6, 86_400_000
MILLISECONDS, RESERVED = 0x0FFF_FFFF, 0xF000_0000
CANNOT_PRODUCE = {0x0609_0030, 0x0601_0002, 0x0800_0000}
PATIENCE_MS = 5_000
"""Longest period of TIME, which CiA 301 does not define (assumed)."""
SETTLE_MS = 20


def time_of_day(milliseconds: int, days: int) -> bytes:
    """Return a TIME_OF_DAY (CiA 301 7.4.7.1)."""
    return milliseconds.to_bytes(4, "little") + days.to_bytes(2, "little")


def shown(device: Device, variable: Entry) -> bytes:
    """Return the value of the object that shows the time."""
    device.wire.run(SETTLE_MS)
    return device.sdo.upload(variable.index, variable.subindex)


def clock(device: Device) -> Entry:
    """Return the object that shows the network time; skip the case without such an object."""
    need_writable(device, TIME_COB_ID)
    variables = [
        v
        for v in device.eds.variables.values()
        if v.type.name == "TIME_OF_DAY" and v.readable and not v.writable
    ]
    if not variables:
        pytest.skip("no object shows the time")
    device.sdo.write(TIME_COB_ID, 0, CONSUME | TIME, 4)
    return variables[0]


@case("12.1")
def test_time_has_the_identifier_of_the_eds(device: Device) -> None:
    """0x1012 has the default of the EDS, with an identifier that is not restricted."""
    need_object(device, TIME_COB_ID)
    value = device.sdo.upload(TIME_COB_ID)
    assert value == (device.eds.default(device.eds.variables[TIME_COB_ID, 0]) or value)


@case("12.2")
def test_time_is_shown(device: Device) -> None:
    """The object shows the time of the TIME message."""
    variable = clock(device)
    for message in (time_of_day(43_200_000, 15_000), time_of_day(1, 15_001)):
        device.wire.send(TIME, message)
        assert shown(device, variable) == message


@case("12.3")
def test_time_is_not_consumed_unasked(device: Device) -> None:
    """Without bit 31 of 0x1012 TIME is ignored."""
    variable = clock(device)
    device.sdo.write(TIME_COB_ID, 0, TIME, 4)
    before = shown(device, variable)
    device.wire.send(TIME, time_of_day(43_200_000, 15_000))
    assert shown(device, variable) == before


@case("12.4")
def test_time_has_six_bytes(device: Device) -> None:
    """A message of four bytes is ignored."""
    variable = clock(device)
    before = shown(device, variable)
    device.wire.send(TIME, time_of_day(43_200_000, 15_000)[:4])
    assert shown(device, variable) == before


@case("12.6")
def test_time_goes_on_from_1984(device: Device) -> None:
    """A device that has received TIME and then produces it continues from the time received."""
    clock(device)
    days = 15_000
    device.wire.send(TIME, time_of_day(43_200_000, days))
    device.wire.run(SETTLE_MS)
    code = device.sdo.write_code(TIME_COB_ID, 0, (PRODUCE | TIME).to_bytes(4, "little"))
    since = len(device.wire.log)
    data = device.wire.await_frame(TIME, since=since, patience_ms=PATIENCE_MS)
    if code or data is None:
        pytest.skip("the device produces no TIME within 5 s")
    shown_days = int.from_bytes(data[4:], "little")
    if shown_days == 0:
        pytest.skip("the device has a clock of its own, which TIME does not set")
    assert shown_days == days, f"{shown_days} days since 1984, {days} received"


@case("12.5")
def test_time_passes(device: Device) -> None:
    """A producer's messages have six bytes, and their distance equals the difference of times."""
    need_writable(device, TIME_COB_ID)
    code = device.sdo.write_code(TIME_COB_ID, 0, (PRODUCE | TIME).to_bytes(4, "little"))
    if code:
        assert code in CANNOT_PRODUCE, f"bit 30 of 1012 ends with {code:08X}"
        pytest.skip("the device does not produce TIME")
    since, heard = 0, []
    for _ in range(2):
        data = device.wire.await_frame(TIME, since=since, patience_ms=PATIENCE_MS)
        if data is None:
            pytest.skip("no TIME in 5 s; CiA 301 does not define its period")
        assert len(data) == LENGTH
        since = len(device.wire.log)
        heard.append((device.wire.now_ns / NS_PER_MS, _milliseconds(data)))
    (begin, first), (end, second) = heard
    assert second - first == pytest.approx(end - begin, rel=0.25, abs=50)


def _milliseconds(data: bytes) -> int:
    """Return a TIME_OF_DAY in ms since 1984."""
    number = int.from_bytes(data, "little")
    assert not number & RESERVED, f"{data.hex()}: the upper bits of the milliseconds are reserved"
    assert number & MILLISECONDS < MS_PER_DAY, f"{data.hex()} is not a time of day"
    return (number >> 32) * MS_PER_DAY + (number & MILLISECONDS)
