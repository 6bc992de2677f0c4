"""Boot-up and heartbeat (CiA 301 7.2.8.3.2)."""

from device_master import HEARTBEAT, Master


def test_heartbeat_keeps_its_period(master: Master) -> None:
    """Heartbeats are sent every 100 ms, counted from boot-up."""
    master.run(350)
    assert master.times_ms(HEARTBEAT) == [0, 100, 200, 300]


def test_new_period_starts_with_its_write(master: Master) -> None:
    """A heartbeat follows the write of the period at once, further ones after each period."""
    master.run(30)
    master.remote.sdo[0x1017].raw = 7
    written = master.network.now_ns / 1e6 - 1
    master.run(30)
    assert [t - written for t in master.times_ms(HEARTBEAT) if t] == [0, 7, 14, 21, 28]


def test_zero_switches_the_heartbeat_off(master: Master) -> None:
    """With 0 in 0x1017 no heartbeat is sent."""
    master.remote.sdo[0x1017].raw = 0
    master.forget()
    master.run(1000)
    assert master.frames == []


def test_a_change_of_state_shows_in_the_next_heartbeat(master: Master) -> None:
    """A change of state does not send a heartbeat; the next periodic one shows it."""
    master.run(50)
    master.nmt(2)
    assert len(master.data(HEARTBEAT)) == 1
    master.run(60)
    assert master.data(HEARTBEAT)[1:] == [b"\x04"]
    assert master.remote.nmt.state == "STOPPED"
