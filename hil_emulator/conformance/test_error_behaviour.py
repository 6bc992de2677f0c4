"""Chapter 7, additional cases: times of error control and error behaviour (7.2.8.3.2)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_emergency, need_guarding, need_writable
from hil_emulator.conformance.device import (
    GUARD_TIME,
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    LIFE_TIME_FACTOR,
    OPERATIONAL,
    PRE_OPERATIONAL,
    SAVE,
    STOPPED,
    STORE_PARAMETERS,
    Device,
)
from hil_emulator.conformance.errors import LIFE_GUARD_OR_HEARTBEAT, beat, watch_other_node
from hil_emulator.conformance.test_guarding import TOGGLE
from hil_emulator.conformance.test_heartbeat import PERIOD_MS, check_beats
from hil_emulator.conformance.wire import NS_PER_MS

ERROR_BEHAVIOUR, COMMUNICATION = 0x1029, 1
BEHAVIOURS = {0: PRE_OPERATIONAL, 1: OPERATIONAL, 2: STOPPED}
"""State after a communication error, by the value of 0x1029:01 (CiA 301 7.5.2.32)."""
CONSUMER_MS = 300
SHORT_MS = 100
MOST_ENTRIES = 4
"""Largest number of entries of 0x1016 that a case tries, of up to 127 (assumed)."""


@case("7.301")
def test_heartbeats_begin_with_boot_up(storing: Device) -> None:
    """With a stored heartbeat time, heartbeats are sent after the next boot-up by default."""
    need_writable(storing, HEARTBEAT_PRODUCER)
    need_writable(storing, STORE_PARAMETERS, 1)
    storing.sdo.write(HEARTBEAT_PRODUCER, 0, PERIOD_MS, 2)
    storing.sdo.download(STORE_PARAMETERS, 1, SAVE)
    storing.reset()
    check_beats(storing)


@case("7.302")
def test_lost_heartbeat_is_reported_in_time(device: Device) -> None:
    """The emergency 8130 is sent soon after the consumer time, not before."""
    need_emergency(device)
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    watch_other_node(device, CONSUMER_MS)
    begin_ns, since = device.wire.now_ns, len(device.wire.log)
    beat(device)
    assert device.await_emergency(LIFE_GUARD_OR_HEARTBEAT, since) is not None, "no emergency"
    elapsed_ms = (device.wire.now_ns - begin_ns) / NS_PER_MS
    assert 0.9 * CONSUMER_MS <= elapsed_ms <= 3 * CONSUMER_MS, f"after {elapsed_ms:.0f} ms"


@case("7.303")
def test_unheard_node_is_not_watched(device: Device) -> None:
    """Monitoring starts with the first heartbeat, not with the write of 0x1016."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    since = len(device.wire.log)
    watch_other_node(device, CONSUMER_MS)
    device.wire.run(2 * CONSUMER_MS)
    assert LIFE_GUARD_OR_HEARTBEAT not in device.emergencies(since)


@case("7.304")
def test_error_behaviour_is_obeyed(device: Device) -> None:
    """A lost heartbeat leads to the state of 0x1029:01, or to PRE-OPERATIONAL without it."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    if not device.watch_state():
        pytest.skip("the device shows its state by no heartbeat")
    configurable = device.eds.writable(ERROR_BEHAVIOUR, COMMUNICATION)
    for value, state in BEHAVIOURS.items() if configurable else [(0, PRE_OPERATIONAL)]:
        if configurable:
            device.sdo.write(ERROR_BEHAVIOUR, COMMUNICATION, value, 1)
        watch_other_node(device, CONSUMER_MS)
        device.enter(OPERATIONAL)
        beat(device)
        device.wire.run(2 * CONSUMER_MS)
        device.expect_state(state)
        device.nmt(128)
        device.expect_state(PRE_OPERATIONAL)


@case("7.305")
def test_guarding_shows_each_state(device: Device) -> None:
    """A guarding answer carries the number of the state."""
    need_guarding(device)
    if device.eds.writable(HEARTBEAT_PRODUCER):
        device.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
    device.enter(OPERATIONAL)
    assert device.guarded_state() == OPERATIONAL
    device.nmt(2)
    device.wire.run(100)
    assert device.guarded_state() == STOPPED


@case("7.306")
def test_life_time_is_waited_for(device: Device) -> None:
    """The emergency is sent after guard time times life time factor, not before."""
    need_emergency(device)
    need_guarding(device)
    if device.eds.writable(HEARTBEAT_PRODUCER):
        device.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
    device.sdo.write(GUARD_TIME, 0, 200, 2)
    device.sdo.write(LIFE_TIME_FACTOR, 0, 3, 1)
    since = len(device.wire.log)
    assert device.guard() is not None
    device.wire.run(400)
    assert device.emergencies(since) == []
    assert device.await_emergency(LIFE_GUARD_OR_HEARTBEAT, since) is not None


@case("7.307")
def test_each_entry_names_a_node(device: Device) -> None:
    """A node that stops sending is reported, whichever entry of 0x1016 monitors it."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    need_emergency(device)
    entries = [n for i, n in device.eds.variables if i == HEARTBEAT_CONSUMER and n]
    for subindex in entries[:MOST_ENTRIES]:
        device.reset()
        watch_other_node(device, SHORT_MS, subindex)
        since = len(device.wire.log)
        beat(device)
        reported = device.await_emergency(LIFE_GUARD_OR_HEARTBEAT, since)
        assert reported is not None, f"entry {subindex} is not monitored"


@case("7.308")
def test_node_that_is_back_is_watched(device: Device) -> None:
    """A node that is lost, returns and is lost again is reported twice."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    need_emergency(device)
    watch_other_node(device, SHORT_MS)
    for time in ("first", "second"):
        since = len(device.wire.log)
        beat(device)
        reported = device.await_emergency(LIFE_GUARD_OR_HEARTBEAT, since)
        assert reported is not None, f"not reported the {time} time"


@case("7.309")
def test_watching_ends_with_zero(device: Device) -> None:
    """After 0 is written to 0x1016:01, a node that stops sending is not reported."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    watch_other_node(device, CONSUMER_MS)
    since = len(device.wire.log)
    beat(device)
    device.sdo.write(HEARTBEAT_CONSUMER, 1, 0, 4)
    device.wire.run(2 * CONSUMER_MS)
    assert LIFE_GUARD_OR_HEARTBEAT not in device.emergencies(since)


@case("7.310")
def test_life_guarding_obeys_the_error_behaviour(device: Device) -> None:
    """A lost master leads to the state of 0x1029:01, or to PRE-OPERATIONAL without it."""
    need_guarding(device)
    if device.eds.writable(HEARTBEAT_PRODUCER):
        device.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
    configurable = device.eds.writable(ERROR_BEHAVIOUR, COMMUNICATION)
    for value, state in BEHAVIOURS.items() if configurable else [(0, PRE_OPERATIONAL)]:
        if configurable:
            device.sdo.write(ERROR_BEHAVIOUR, COMMUNICATION, value, 1)
        device.sdo.write(GUARD_TIME, 0, SHORT_MS, 2)
        device.sdo.write(LIFE_TIME_FACTOR, 0, 1, 1)
        device.enter(OPERATIONAL)
        assert device.guarded_state() == OPERATIONAL
        device.wire.run(3 * SHORT_MS)
        assert device.guarded_state() == state, f"with {value} in 1029:01"
        device.enter(PRE_OPERATIONAL)


@case("7.311")
def test_toggle_bit_ignores_states(device: Device) -> None:
    """A change of state does not reset the toggle bit."""
    need_guarding(device)
    if device.eds.writable(HEARTBEAT_PRODUCER):
        device.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
    answers = [device.guard()]
    for state in (OPERATIONAL, PRE_OPERATIONAL):
        device.enter(state)
        answers.append(device.guard())
    assert [answer and answer[0] & TOGGLE for answer in answers] == [0, TOGGLE, 0]
