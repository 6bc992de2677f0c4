"""Chapter 5: EMCY, error register and error history (CiA 301 7.2.7)."""

import pytest

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import need_object, need_writable
from hil_emulator.conformance.device import (
    EMCY_COB_ID,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    STOPPED,
    Device,
)
from hil_emulator.conformance.errors import (
    LostMaster,
    LostNode,
    OverdueRpdo,
    bring_about,
    provoke,
    ways,
)
from hil_emulator.conformance.wire import NS_PER_MS

ERROR_REGISTER, ERROR_HISTORY = 0x1001, 0x1003
INHIBIT_TIME = 0x1015
GENERIC, COMMUNICATION, RESERVED = 0x01, 0x10, 0x40
NO_DATA = 0x0800_0024
NO_COUNT = {0x0609_0030, 0x0609_0031, 0x0800_0000}
NO_EMERGENCY = 1 << 31
OTHER_ID = 0x6B1
"""Identifier that is not restricted and not in the predefined connection set (7.3.5)."""
WATCH_MS, INHIBIT_MS = 300, 400
RETURNING = LostNode | OverdueRpdo | LostMaster
"""Errors caused by a missing message, which end with the next message."""


@case("5.1")
def test_emergency_identifier(device: Device) -> None:
    """0x1014 has the identifier of the predefined connection set, as in the EDS."""
    need_object(device, EMCY_COB_ID)
    value = device.sdo.upload(EMCY_COB_ID)
    assert value == device.eds.default(device.eds.variables[EMCY_COB_ID, 0])
    assert int.from_bytes(value, "little") == 0x080 + device.node_id


@case("5.2")
def test_error_register_is_consistent(device: Device) -> None:
    """The reserved bit is 0, and the generic bit is set with any other."""
    register = device.sdo.read(ERROR_REGISTER)
    assert not register & RESERVED
    assert register == 0 or register & GENERIC


@case("5.3")
def test_history_is_empty_after_a_reset(device: Device) -> None:
    """0x1003:00 is the number of readable errors; if it is 0, 0x1003:01 has no data."""
    need_object(device, ERROR_HISTORY)
    count = device.sdo.read(ERROR_HISTORY)
    code = device.sdo.read_code(ERROR_HISTORY, 1)
    assert code == 0 if count else code in (0, NO_DATA)
    if count == 0 and code == 0:
        assert device.sdo.read(ERROR_HISTORY, 1) == 0


@case("5.4")
def test_error_is_reported(device: Device) -> None:
    """An error caused from the bus is reported in an emergency of eight bytes."""
    assert len(provoke(device)) == 8


@case("5.5")
def test_error_is_shown_in_the_register(device: Device) -> None:
    """The emergency carries the same error register as an SDO read."""
    emergency = provoke(device)
    register = device.sdo.read(ERROR_REGISTER)
    assert register & GENERIC
    assert emergency[2] == register


@case("5.6")
def test_error_is_remembered(device: Device) -> None:
    """The newest error of the history has the code of the emergency."""
    need_object(device, ERROR_HISTORY)
    emergency = provoke(device)
    assert device.sdo.read(ERROR_HISTORY) >= 1
    assert device.sdo.upload(ERROR_HISTORY, 1)[:2] == emergency[:2]


@case("5.301")
def test_no_emergency_in_stopped(device: Device) -> None:
    """An error in STOPPED sends no emergency in STOPPED."""
    way = next((way for way in ways(device) if isinstance(way, LostNode | LostMaster)), None)
    if way is None:
        pytest.skip("no error can be caused in STOPPED")
    way.cause()
    device.enter(STOPPED)
    since = len(device.wire.log)
    device.wire.run(WATCH_MS)
    assert device.emergencies(since) == []


@case("5.302")
def test_error_reset_is_sent(device: Device) -> None:
    """When the error ends, 0000 is sent and the error register has its previous value."""
    register = device.sdo.read(ERROR_REGISTER)
    way = ways(device)[0]
    bring_about(way)
    since = len(device.wire.log)
    way.end()
    reset = device.await_emergency(0, since)
    assert reset is not None, "no error reset"
    assert reset[2] == register == device.sdo.read(ERROR_REGISTER)


@case("5.303")
def test_error_is_reported_once(device: Device) -> None:
    """A repeated cause is one error and one emergency."""
    way = next((way for way in ways(device) if way.repeatable), None)
    if way is None:
        pytest.skip("no error can be caused twice")
    since = len(device.wire.log)
    bring_about(way)
    for _ in range(3):
        way.cause()
    device.barrier()
    assert device.emergencies(since).count(way.code) == 1


@case("5.304")
def test_newest_error_comes_first(device: Device) -> None:
    """Of two errors, 0x1003:01 has the second, 0x1003:02 the first."""
    need_object(device, ERROR_HISTORY)
    need_object(device, ERROR_HISTORY, 2)
    offered = ways(device)
    first = next((way for way in offered if way.repeatable), None)
    second = next((way for way in offered if not way.repeatable), None)
    if first is None or second is None:
        pytest.skip("the device offers only one kind of error")
    # the first needs OPERATIONAL, which an error may end
    reported = [bring_about(way)[:2] for way in (first, second)]
    assert device.sdo.read(ERROR_HISTORY) >= len(reported)
    kept = [device.sdo.upload(ERROR_HISTORY, n)[:2] for n in range(1, len(reported) + 1)]
    assert kept == reported[::-1]


@case("5.305")
def test_history_is_emptied(device: Device) -> None:
    """0x1003:00 refuses all values but 0, which clears the history."""
    need_writable(device, ERROR_HISTORY)
    provoke(device)
    assert device.sdo.write_code(ERROR_HISTORY, 0, b"\x01") in NO_COUNT
    assert device.sdo.read(ERROR_HISTORY) >= 1
    device.sdo.write(ERROR_HISTORY, 0, 0, 1)
    assert device.sdo.read(ERROR_HISTORY) == 0
    assert device.sdo.read_code(ERROR_HISTORY, 1) or not device.sdo.read(ERROR_HISTORY, 1)


@case("5.306")
def test_emergency_has_its_identifier(device: Device) -> None:
    """Emergencies have the identifier of 0x1014, and are not sent with its bit 31 set."""
    need_writable(device, EMCY_COB_ID)
    way = ways(device)[0]
    disabled = NO_EMERGENCY | device.sdo.read(EMCY_COB_ID)
    device.sdo.write(EMCY_COB_ID, 0, disabled, 4)
    device.sdo.write(EMCY_COB_ID, 0, OTHER_ID, 4)
    since = len(device.wire.log)
    way.cause()
    assert device.wire.await_frame(OTHER_ID, since=since) is not None, (
        "no emergency with the new identifier"
    )
    assert device.emergencies(since) == [], "an emergency with the old identifier"
    device.reset()
    device.sdo.write(EMCY_COB_ID, 0, NO_EMERGENCY | device.emergency_id, 4)
    since = len(device.wire.log)
    way = ways(device)[0]
    way.cause()
    device.wire.run(WATCH_MS)
    assert device.emergencies(since) == [], "an emergency without an identifier"


@case("5.307")
def test_emergencies_keep_their_distance(device: Device) -> None:
    """A second emergency waits for the end of the inhibit time 0x1015, and not much longer."""
    need_writable(device, INHIBIT_TIME)
    device.sdo.write(INHIBIT_TIME, 0, 10 * INHIBIT_MS, 2)
    way = ways(device)[0]
    bring_about(way)
    since = len(device.wire.log)
    begin_ns = device.wire.now_ns
    way.end()
    assert device.await_emergency(0, since) is not None, "no error reset"
    elapsed_ms = (device.wire.now_ns - begin_ns) / NS_PER_MS
    assert INHIBIT_MS / 2 < elapsed_ms < 3 * INHIBIT_MS, f"after {elapsed_ms:.0f} ms"


@case("5.308")
def test_each_error_is_cleared(device: Device) -> None:
    """When heartbeats, an overdue RPDO or guarding requests return, 0000 is sent."""
    kinds = [type(way) for way in ways(device) if isinstance(way, RETURNING)]
    if not kinds:
        pytest.skip("the device offers no error whose cause ends without a command")
    for kind in kinds:
        device.reset()
        way = kind(device)
        register = device.sdo.read(ERROR_REGISTER)
        bring_about(way)
        since = len(device.wire.log)
        way.correct()
        reset = device.await_emergency(0, since)
        assert reset is not None, f"no error reset after {way.code:04X}: {kind.__doc__}"
        device.enter(PRE_OPERATIONAL)
        assert device.sdo.read(ERROR_REGISTER) == register, f"register after {way.code:04X}"


@case("5.309")
def test_history_restarts(device: Device) -> None:
    """After 0 is written to 0x1003:00 the next error is the only one in the history."""
    need_writable(device, ERROR_HISTORY)
    need_object(device, ERROR_HISTORY, 2)
    offered = ways(device)
    first, second = offered[0], offered[-1]
    if first is second:
        pytest.skip("the device offers only one kind of error")
    bring_about(second)
    device.sdo.write(ERROR_HISTORY, 0, 0, 1)
    emergency = bring_about(first)
    assert device.sdo.read(ERROR_HISTORY) == 1, "one error since the history was emptied"
    assert device.sdo.upload(ERROR_HISTORY, 1)[:2] == emergency[:2]
    assert device.sdo.read_code(ERROR_HISTORY, 2) or not device.sdo.read(ERROR_HISTORY, 2)


@case("5.310")
def test_communication_errors_have_their_bit(device: Device) -> None:
    """Emergencies 81xx and 82xx set bit 4 of the error register."""
    emergency = provoke(device)
    assert emergency[2] & COMMUNICATION, f"error register {emergency[2]:02X}"


@case("5.311")
def test_reset_forgets_errors(device: Device) -> None:
    """After either reset error register and history are the same as after power-on."""
    register = device.sdo.read(ERROR_REGISTER)
    history = device.eds.variables.get((ERROR_HISTORY, 0))
    count = None if history is None else device.eds.default(history)
    kind = type(ways(device)[0])
    for command in (RESET_NODE, RESET_COMMUNICATION):
        bring_about(kind(device))
        device.reset(command)
        assert device.sdo.read(ERROR_REGISTER) == register, f"register after command {command}"
        if count is not None:
            assert device.sdo.upload(ERROR_HISTORY) == count, f"history after command {command}"
