"""Chapter 7, first part: node guarding and life guarding (CiA 301 7.2.8.3.2.1)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import (
    need_emergency,
    need_guarding,
    need_object,
    need_writable,
)
from hil_emulator.conformance.device import (
    GUARD_TIME,
    HEARTBEAT_PRODUCER,
    LIFE_TIME_FACTOR,
    PRE_OPERATIONAL,
    Device,
)
from hil_emulator.conformance.errors import LIFE_GUARD_OR_HEARTBEAT

TOGGLE = 0x80


@pytest.fixture
def guarded(device: Device) -> Device:
    """Return the device just booted, with its heartbeat off and guarding on."""
    need_guarding(device)
    if device.eds.writable(HEARTBEAT_PRODUCER):
        device.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
    return device


@case("7.1")
def test_guarding_parameters(device: Device) -> None:
    """0x100C and 0x100D have the defaults of the EDS."""
    for index in (GUARD_TIME, LIFE_TIME_FACTOR):
        need_object(device, index)
        assert device.sdo.upload(index) == device.eds.default(device.eds.variables[index, 0])


@case("7.2")
def test_guarding_is_answered(guarded: Device) -> None:
    """A remote frame is answered with the state in one byte."""
    answer = guarded.guard()
    assert answer is not None, "no answer to a guarding request"
    assert len(answer) == 1
    assert answer[0] & ~TOGGLE == PRE_OPERATIONAL


@case("7.3")
def test_toggle_bit(guarded: Device) -> None:
    """The first answer after boot-up has toggle 0, and each answer toggles the bit."""
    answers = [guarded.guard() for _ in range(5)]
    assert [answer and answer[0] & TOGGLE for answer in answers] == [0, TOGGLE, 0, TOGGLE, 0]
    guarded.reset()
    if guarded.eds.writable(HEARTBEAT_PRODUCER):
        guarded.sdo.write(HEARTBEAT_PRODUCER, 0, 0, 2)
    first = guarded.guard()
    assert first is not None
    assert not first[0] & TOGGLE, "the toggle bit went on over a reset"


@case("7.4")
def test_other_nodes_guarding_is_not_answered(guarded: Device) -> None:
    """The device answers only the request to its node-ID, of requests to all 127 nodes."""
    since = len(guarded.wire.log)
    for node_id in range(1, 128):
        guarded.wire.send(0x700 + node_id, remote=True)
        guarded.wire.run(1)
    guarded.barrier()
    assert len(guarded.wire.heard(guarded.error_control_id, since)) == 1


@case("7.5")
def test_guarding_parameters_are_taken(device: Device) -> None:
    """0x100C and 0x100D return the values written."""
    need_writable(device, GUARD_TIME)
    need_writable(device, LIFE_TIME_FACTOR)
    device.sdo.write(GUARD_TIME, 0, 500, 2)
    device.sdo.write(LIFE_TIME_FACTOR, 0, 3, 1)
    assert device.sdo.read(GUARD_TIME) == 500
    assert device.sdo.read(LIFE_TIME_FACTOR) == 3


@case("7.6")
def test_lost_master_is_reported(guarded: Device) -> None:
    """When requests stop for guard time times life time factor, an emergency 8130 is sent."""
    need_emergency(guarded)
    guarded.sdo.write(GUARD_TIME, 0, 200, 2)
    guarded.sdo.write(LIFE_TIME_FACTOR, 0, 3, 1)
    since = len(guarded.wire.log)
    for _ in range(5):
        assert guarded.guard() is not None
        guarded.wire.run(20)
    assert guarded.emergencies(since) == [], "an emergency while the master sends requests"
    assert guarded.await_emergency(LIFE_GUARD_OR_HEARTBEAT, since) is not None
