"""Heartbeat consumer, guarding, and the reaction to a loss (CiA 301)."""

import pytest
from device_master import EMCY, HEARTBEAT, RPDO1, Master

from hil_emulator.frame import Frame

PARTNER, PARTNER_ID = 0x700 + 9, 9
OPERATIONAL, STOPPED, PRE_OPERATIONAL = 5, 4, 127
LOST, GOOD = 0x8130, 0x0000


def codes(master: Master) -> list[int]:
    """Return the emergency codes received, oldest first."""
    return [int.from_bytes(data[:2], "little") for data in master.data(EMCY)]


def watch(master: Master, time_ms: int) -> None:
    """Make the device monitor its partner's heartbeat."""
    master.remote.sdo[0x1016][1].raw = PARTNER_ID << 16 | time_ms


def state(master: Master) -> int:
    """Return the state of the next heartbeat."""
    before = len(master.data(HEARTBEAT))
    master.run(101)
    return master.data(HEARTBEAT)[before][0]


def test_lost_heartbeat_is_reported_and_stops_the_plant(master: Master) -> None:
    """After the time-out: EMCY 0x8130 with the node-ID, PRE-OPERATIONAL, safe commands."""
    master.remote.sdo[0x1400][5].raw = 0
    watch(master, 50)
    master.start()
    master.send(RPDO1, (5_000_000).to_bytes(4, "little"))
    master.send(PARTNER, b"\x05")
    master.run(49)
    assert codes(master) == []
    assert master.commands["valve_current"] == pytest.approx(0.005)
    master.run(1)
    assert codes(master) == [LOST]
    assert master.data(EMCY)[0][3] == PARTNER_ID
    assert master.commands["valve_current"] == pytest.approx(0.001)
    assert state(master) == PRE_OPERATIONAL


def test_regular_heartbeats_cause_no_error(master: Master) -> None:
    """A partner whose heartbeats are in time is never reported."""
    watch(master, 50)
    for _ in range(10):
        master.send(PARTNER, b"\x05")
        master.run(48)
    assert codes(master) == []


def test_partner_is_not_missed_before_its_first_heartbeat(master: Master) -> None:
    """Monitoring starts with the first heartbeat."""
    watch(master, 50)
    master.run(500)
    assert codes(master) == []


def test_returning_partner_ends_the_error(master: Master) -> None:
    """The next heartbeat causes the error reset, and monitoring continues."""
    watch(master, 50)
    master.send(PARTNER, b"\x05")
    master.run(60)
    master.send(PARTNER, b"\x05")
    assert codes(master) == [LOST, GOOD]
    master.run(60)
    assert codes(master) == [LOST, GOOD, LOST]


def test_one_node_is_watched_once(master: Master) -> None:
    """A second entry for a node aborts with 0604 0043; an unused one does not."""
    watch(master, 50)
    entry = (PARTNER_ID << 16 | 70).to_bytes(4, "little")
    assert master.abort_code(0x1016, 2, entry) == 0x06040043
    assert master.abort_code(0x1016, 1, entry) == 0
    assert master.abort_code(0x1016, 2, (PARTNER_ID << 16).to_bytes(4, "little")) == 0


@pytest.mark.parametrize(("behaviour", "then"), [(0, PRE_OPERATIONAL), (1, 5), (2, STOPPED)])
def test_error_behaviour_decides_the_state(master: Master, behaviour: int, then: int) -> None:
    """0x1029:01 is the state after a lost heartbeat."""
    master.remote.sdo[0x1029][1].raw = behaviour
    watch(master, 50)
    master.start()
    master.send(PARTNER, b"\x05")
    master.run(60)
    assert state(master) == then


def test_error_behaviour_has_a_range(master: Master) -> None:
    """0x1029:01 is 0, 1 or 2."""
    assert master.abort_code(0x1029, 1, b"\3") == 0x06090031


def guard(master: Master) -> list[int]:
    """Send one guarding request and return the bytes answered."""
    sent = master.network.tick(Frame(HEARTBEAT, remote=True))
    return [frame.data[0] for frame in sent if frame.can_id == HEARTBEAT]


def test_guarding_answers_with_state_and_toggle_bit(master: Master) -> None:
    """Answers alternate bit 7, from 0 after boot-up."""
    master.remote.sdo[0x1017].raw = 0
    assert [guard(master) for _ in range(3)] == [[127], [127 | 0x80], [127]]
    master.nmt(130)
    master.remote.sdo[0x1017].raw = 0
    assert guard(master) == [127]
    master.nmt(2)
    assert guard(master) == [STOPPED | 0x80]


def test_heartbeat_excludes_guarding(master: Master) -> None:
    """While the heartbeat is on, guarding requests stay unanswered."""
    assert guard(master) == []


def test_lost_master_is_reported(master: Master) -> None:
    """Guard time by life time factor after the last request: EMCY 0x8130, once."""
    master.remote.sdo[0x1017].raw = 0
    master.remote.sdo[0x100C].raw = 10
    master.remote.sdo[0x100D].raw = 3
    master.run(100)
    assert codes(master) == []
    guard(master)
    master.run(29)
    assert codes(master) == []
    master.run(100)
    assert codes(master) == [LOST]
    guard(master)
    assert codes(master) == [LOST, GOOD]


def test_each_partner_has_its_own_time(master: Master) -> None:
    """A later heartbeat of a slow partner does not delay the time-out of a fast one."""
    watch(master, 50)
    master.remote.sdo[0x1016][2].raw = 10 << 16 | 500
    master.send(PARTNER, b"\x05")
    master.send(0x700 + 10, b"\x05")
    master.run(60)
    assert [data[3] for data in master.data(EMCY)] == [PARTNER_ID]


def test_reset_ends_monitoring(master: Master) -> None:
    """Reset communication clears 0x1016 and ends monitoring."""
    watch(master, 50)
    master.send(PARTNER, b"\x05")
    master.nmt(130)
    master.run(100)
    assert codes(master) == []
