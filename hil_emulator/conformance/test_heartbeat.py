"""Chapter 7, second part: heartbeat, alone and with guarding (CiA 301 7.2.8.3.2.2)."""

from hil_emulator.conformance.cases import case
from hil_emulator.conformance.demands import (
    NO_SUCH_OBJECT,
    need_emergency,
    need_guarding,
    need_remote_frames,
    need_writable,
)
from hil_emulator.conformance.device import (
    GUARD_TIME,
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    LIFE_TIME_FACTOR,
    PRE_OPERATIONAL,
    SETTLE_MS,
    Device,
)
from hil_emulator.conformance.errors import (
    LIFE_GUARD_OR_HEARTBEAT,
    LOST,
    other_node,
    watch_other_node,
)
from hil_emulator.conformance.situations import check_rate

PERIOD_MS = 40
MINUTE_MS = 60_000
WATCH_MS = 600
INCOMPATIBLE = {0x0604_0043, 0x0800_0000}


def produce(device: Device, period_ms: int) -> None:
    """Set the heartbeat time."""
    need_writable(device, HEARTBEAT_PRODUCER)
    device.sdo.write(HEARTBEAT_PRODUCER, 0, device.eds.limited(HEARTBEAT_PRODUCER, period_ms), 2)


def set_guarding(device: Device, guard_ms: int, factor: int) -> None:
    """Set guard time and life time factor, if they exist."""
    if device.eds.writable(GUARD_TIME) and device.eds.writable(LIFE_TIME_FACTOR):
        device.sdo.write(GUARD_TIME, 0, guard_ms, 2)
        device.sdo.write(LIFE_TIME_FACTOR, 0, factor, 1)


def check_beats(device: Device) -> None:
    """Check that heartbeats are sent at their period and show the state."""
    beats, elapsed_ms = device.wire.watch(device.error_control_id, 3, WATCH_MS)
    check_rate(len(beats), elapsed_ms, PERIOD_MS, "heartbeat time")
    assert set(beats) == {bytes([PRE_OPERATIONAL])}


def check_silent(device: Device, *, requests: int = 0) -> None:
    """Check that no heartbeat is sent and no guarding request is answered."""
    device.wire.run(SETTLE_MS)  # a new heartbeat time may begin with a heartbeat
    since = len(device.wire.log)
    for _ in range(requests):
        device.wire.send(device.error_control_id, remote=True)
        device.wire.run(10)
    device.wire.run(WATCH_MS)
    assert device.wire.heard(device.error_control_id, since) == []


@case("7.101")
def test_heartbeat_time_is_taken(device: Device) -> None:
    """0x1017 returns the value written."""
    produce(device, 1234)
    assert device.sdo.read(HEARTBEAT_PRODUCER) == 1234


@case("7.102")
def test_heartbeats_are_counted(device: Device) -> None:
    """Heartbeats are sent at their period."""
    produce(device, PERIOD_MS)
    check_beats(device)


@case("7.103")
def test_heartbeat_is_switched_off(device: Device) -> None:
    """After 0x1017 is set to 0 there are no heartbeats."""
    produce(device, PERIOD_MS)
    check_beats(device)
    produce(device, 0)
    check_silent(device)


@case("7.104")
def test_one_node_is_not_watched_twice(device: Device) -> None:
    """A node in a second entry of 0x1016 is refused; rewriting its entry is accepted."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    need_writable(device, HEARTBEAT_CONSUMER, 2)
    watch_other_node(device, 500)
    watch_other_node(device, 500)
    value = device.sdo.upload(HEARTBEAT_CONSUMER, 1)
    assert device.sdo.write_code(HEARTBEAT_CONSUMER, 2, value) in INCOMPATIBLE


@case("7.105")
def test_heartbeats_in_time_are_no_error(device: Device) -> None:
    """A node that sends heartbeats at a tenth of the consumer time is not reported."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    watch_other_node(device, 1000)
    since = len(device.wire.log)
    for _ in range(12):
        device.wire.send(0x700 + other_node(device), LOST)
        device.wire.run(100)
    assert LIFE_GUARD_OR_HEARTBEAT not in device.emergencies(since)


@case("7.106")
def test_late_heartbeats_are_reported(device: Device) -> None:
    """A node whose next heartbeat is late is reported by an emergency 8130."""
    need_emergency(device)
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    watch_other_node(device, 100)
    since = len(device.wire.log)
    device.wire.send(0x700 + other_node(device), LOST)
    assert device.await_emergency(LIFE_GUARD_OR_HEARTBEAT, since) is not None


@case("7.107")
def test_reset_ends_watching(device: Device) -> None:
    """After a reset of the device, 0x1016 has its default and a lost node is not an error."""
    need_writable(device, HEARTBEAT_CONSUMER, 1)
    before = device.sdo.upload(HEARTBEAT_CONSUMER, 1)
    watch_other_node(device, 1000)
    device.wire.send(0x700 + other_node(device), LOST)
    device.reset()
    since = len(device.wire.log)
    assert device.sdo.upload(HEARTBEAT_CONSUMER, 1) == before
    device.wire.run(1200)
    assert LIFE_GUARD_OR_HEARTBEAT not in device.emergencies(since)


@case("7.201")
def test_heartbeat_and_guarding_objects(device: Device) -> None:
    """0x100C, 0x100D, 0x1016 and 0x1017 exist as in the EDS, with at least one service."""
    for index in (GUARD_TIME, LIFE_TIME_FACTOR, HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER):
        code = device.sdo.read_code(index)
        assert code == 0 if index in device.eds else code in NO_SUCH_OBJECT, f"{index:04X}"
    assert GUARD_TIME in device.eds or HEARTBEAT_PRODUCER in device.eds


@case("7.202")
def test_no_heartbeat_when_off(device: Device) -> None:
    """With the heartbeat off, no error control message is sent without a request."""
    set_guarding(device, 0, 0)
    produce(device, 0)
    check_silent(device)


@case("7.203")
def test_guarding_works_without_heartbeat(device: Device) -> None:
    """With the heartbeat off, guarding requests are answered."""
    need_guarding(device)
    produce(device, 0)
    set_guarding(device, 500, 3)
    assert device.guarded_state() == PRE_OPERATIONAL
    assert device.guarded_state() == PRE_OPERATIONAL


@case("7.204")
def test_heartbeat_without_guarding(device: Device) -> None:
    """With guarding off, heartbeats are sent at their period."""
    set_guarding(device, 0, 0)
    produce(device, PERIOD_MS)
    check_beats(device)


@case("7.205")
def test_heartbeat_answers_no_requests(device: Device) -> None:
    """With the heartbeat on and guarding off, remote frames are not answered."""
    need_remote_frames(device)
    set_guarding(device, 0, 0)
    produce(device, MINUTE_MS)
    check_silent(device, requests=5)


@case("7.206")
def test_heartbeat_beats_guarding(device: Device) -> None:
    """With both services configured, heartbeats are sent."""
    produce(device, PERIOD_MS)
    set_guarding(device, 500, 3)
    check_beats(device)


@case("7.207")
def test_heartbeat_beats_guarding_requests(device: Device) -> None:
    """With both services configured, remote frames are not answered."""
    need_remote_frames(device)
    produce(device, MINUTE_MS)
    set_guarding(device, 500, 3)
    check_silent(device, requests=5)
