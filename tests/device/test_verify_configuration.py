"""Verify configuration (CiA 301 7.5.2.29)."""

from device_master import RPDO1, Master


def stamp(master: Master) -> tuple[int, int]:
    """Return date and time of the configuration."""
    return tuple(master.remote.sdo[0x1020][n].raw for n in (1, 2))  # type: ignore[return-value]


def configure(master: Master) -> None:
    """Change a parameter, stamp the configuration and store it, as a tool does."""
    master.remote.sdo[0x1017].raw = 50
    master.remote.sdo[0x1020][1].raw = 15_000
    master.remote.sdo[0x1020][2].raw = 3_600_000
    assert master.abort_code(0x1010, 1, b"save") == 0


def test_the_stamp_is_stored_with_the_configuration(master: Master) -> None:
    """A tool finds its date and time after a reset."""
    configure(master)
    master.nmt(129)
    master.run(2)
    assert stamp(master) == (15_000, 3_600_000)


def test_another_change_clears_the_stamp(master: Master) -> None:
    """A later write of any parameter clears the date and time."""
    configure(master)
    master.remote.sdo[0x1017].raw = 60
    assert stamp(master) == (0, 0)


def test_process_data_leave_the_stamp(master: Master) -> None:
    """Set points are not parameters, by PDO or SDO."""
    configure(master)
    master.start()
    master.send(RPDO1, bytes(4))
    master.remote.sdo.download(0x2000, 0, bytes(4))
    assert stamp(master) == (15_000, 3_600_000)


def test_a_refused_write_leaves_the_stamp(master: Master) -> None:
    """A refused write does not clear the date and time."""
    configure(master)
    assert master.abort_code(0x1019, 0, b"\x01") != 0
    assert stamp(master) == (15_000, 3_600_000)
