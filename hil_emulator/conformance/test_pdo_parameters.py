"""Chapter 3, fourth part: rules of the communication record (CiA 301 7.5.2.35, 7.5.2.37)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_remote_frames
from hil_emulator.conformance.device import OPERATIONAL, PRE_OPERATIONAL, Device
from hil_emulator.conformance.pdo import (
    COB_ID,
    EVENT_DRIVEN,
    EVENT_TIMER,
    INHIBIT_TIME,
    SYNC_START,
    TRANSMISSION_TYPE,
    Pdo,
    pdos,
    usable,
    word,
)
from hil_emulator.conformance.situations import (
    EVENT_MS,
    EVERY,
    INHIBIT_MS,
    ON_REQUEST,
    SYNC_COUNTER,
    check_rate,
)
from hil_emulator.conformance.test_pdo_mapping import NOT_MAPPABLE, candidates
from hil_emulator.conformance.test_pdo_payload import answer

OTHER_ID = 0x6B0
"""Identifier that is not restricted and not in the predefined connection set (7.3.5)."""
RESERVED_TYPES = (241, 247, 251)
WATCH_MS = 600
LONG_MS = 60_000


def existing(device: Device) -> Pdo:
    """Return a TPDO, enabled."""
    pdo = usable(device)[0]
    pdo.enable()
    return pdo


def check_locked(pdo: Pdo, subindex: int, value: int) -> None:
    """Check that a parameter cannot be changed, with any abort code."""
    if not pdo.offers(subindex):
        pytest.skip(f"{pdo.name} has no sub-index {subindex} to write")
    before = pdo.get(subindex)
    assert pdo.code(subindex, value), f"{pdo.name}: sub-index {subindex} was changed while valid"
    assert pdo.get(subindex) == before


@case("3.321")
def test_identifier_is_locked(device: Device) -> None:
    """The identifier of an enabled PDO cannot be changed."""
    pdo = existing(device)
    check_locked(pdo, COB_ID, pdo.get(COB_ID) & ~0x7FF | OTHER_ID)


@case("3.322")
def test_identifier_is_used(device: Device) -> None:
    """A TPDO has the new identifier, and is not sent with the old one."""
    pdo = usable(device)[0]
    pdo.configure(EVERY)
    pdo.enable()
    before = pdo.can_id
    pdo.disable()
    pdo.set(COB_ID, pdo.get(COB_ID) & ~0x7FF | OTHER_ID)
    pdo.enable()
    device.enter(OPERATIONAL)
    assert answer(device, OTHER_ID) is not None
    assert answer(device, before) is None


@case("3.323")
def test_reserved_types_are_refused(device: Device) -> None:
    """No PDO accepts a transmission type from 241 to 251."""
    for pdo in [pdo for pdo in pdos(device) if pdo.offers(TRANSMISSION_TYPE)]:
        pdo.disable()
        for kind in RESERVED_TYPES:
            assert pdo.code(TRANSMISSION_TYPE, kind), f"{pdo.name} took type {kind}"


@case("3.324")
def test_inhibit_time_is_locked(device: Device) -> None:
    """The inhibit time of a TPDO that exists cannot be changed."""
    check_locked(existing(device), INHIBIT_TIME, 1234)


@case("3.325")
def test_sync_start_is_locked(device: Device) -> None:
    """The SYNC start value of a TPDO that exists cannot be changed."""
    check_locked(existing(device), SYNC_START, 7)


@case("3.326")
def test_wrong_length_is_not_mapped(device: Device) -> None:
    """An entry with twice the bits of its object is refused."""
    for pdo in [pdo for pdo in pdos(device) if pdo.variable]:
        objects = [v for v in candidates(device, pdo) if v.type.bits in (16, 32)]
        if objects:
            bits = 2 * objects[0].type.bits
            entry = word(objects[0]) & ~0xFF | bits
            assert pdo.map([entry]) in NOT_MAPPABLE, f"{pdo.name}: {bits} bits"


@case("3.327")
def test_forbidden_remote_frames_are_not_answered(device: Device) -> None:
    """With bit 30 of its COB-ID set, a TPDO is not sent on a remote frame."""
    need_remote_frames(device)
    pdo = usable(device)[0]
    pdo.configure(ON_REQUEST)
    pdo.enable(remote=True)
    pdo.disable()
    pdo.set(COB_ID, pdo.get(COB_ID) | 1 << 30)
    pdo.enable()
    can_id = pdo.can_id
    device.enter(OPERATIONAL)
    since = len(device.wire.log)
    device.wire.send(can_id, remote=True)
    device.barrier()
    assert device.wire.heard(can_id, since) == []


@case("3.328")
def test_events_wait_for_the_inhibit_time_alone(device: Device) -> None:
    """Events faster than the inhibit time are sent at the rate that the inhibit time allows."""
    pdo = usable(device)[0]
    if not pdo.offers(INHIBIT_TIME):
        pytest.skip(f"{pdo.name} has no inhibit time")
    pdo.configure(EVENT_DRIVEN, inhibit_100us=10 * INHIBIT_MS, event_ms=INHIBIT_MS // 5)
    pdo.enable()
    can_id = pdo.can_id
    device.enter(OPERATIONAL)
    frames, elapsed_ms = device.wire.watch(can_id, 3, WATCH_MS)
    check_rate(len(frames), elapsed_ms, INHIBIT_MS, "inhibit time")


@case("3.329")
def test_event_timer_counts_at_once(device: Device) -> None:
    """A new event timer, written in OPERATIONAL, takes effect at once."""
    pdo = usable(device)[0]
    if not pdo.offers(EVENT_TIMER):
        pytest.skip(f"{pdo.name} has no event timer")
    pdo.configure(EVENT_DRIVEN, event_ms=LONG_MS)
    pdo.enable()
    can_id = pdo.can_id
    device.enter(OPERATIONAL)
    pdo.set(EVENT_TIMER, EVENT_MS)
    frames, elapsed_ms = device.wire.watch(can_id, 3, WATCH_MS)
    check_rate(len(frames), elapsed_ms, EVENT_MS, "new event timer")


@case("3.330")
def test_event_driven_tpdo_answers_remote_frames(device: Device) -> None:
    """With bit 30 of its COB-ID clear, an event-driven TPDO is also sent on a remote frame.

    The case applies to devices that support remote frames (type 253).
    """
    need_remote_frames(device)
    pdo = usable(device)[0]
    pdo.configure(ON_REQUEST)
    pdo.configure(EVENT_DRIVEN, event_ms=LONG_MS)
    pdo.enable(remote=True)
    can_id = pdo.can_id
    device.enter(OPERATIONAL)
    device.wire.run(INHIBIT_MS)
    since = len(device.wire.log)
    device.wire.send(can_id, remote=True)
    assert device.wire.await_frame(can_id, since=since, patience_ms=WATCH_MS) is not None


@case("3.331")
def test_sync_start_value_counts_again(device: Device) -> None:
    """Each time OPERATIONAL is entered, the first SYNC answered has the start value."""
    SYNC_COUNTER.demand(device)
    pdo = usable(device, SYNC_COUNTER.overflow)[0]
    SYNC_COUNTER.configure(pdo)
    pdo.enable()
    for _ in range(2):
        device.enter(PRE_OPERATIONAL)
        device.enter(OPERATIONAL)
        since = len(device.wire.log)
        SYNC_COUNTER.provoke(device, pdo.can_id)
        count = len(device.wire.heard(pdo.can_id, since))
        SYNC_COUNTER.judge(count, 0.0)
