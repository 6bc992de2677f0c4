"""The SYNC consumer's COB-ID (CiA 301 7.5.2.5)."""

import pytest
from device_master import RPDO1, SYNC, TPDO4, Master


def test_stock_producer_is_heard(master: Master) -> None:
    """The stock SYNC producer triggers the synchronous TPDO."""
    master.start()
    master.network.sync.transmit()
    assert len(master.data(TPDO4)) == 1


def test_sync_can_be_moved(master: Master) -> None:
    """After a write of 0x1005 the node accepts the new identifier and not the old one."""
    master.remote.sdo[0x1005].raw = 0x0A0
    master.start()
    master.send(SYNC)
    assert master.data(TPDO4) == []
    master.send(0x0A0)
    assert len(master.data(TPDO4)) == 1


@pytest.mark.parametrize("cob_id", [1 << 29 | 0x80, 0x001, 0x000, 0x601])
def test_sync_cannot_be_hidden(master: Master, cob_id: int) -> None:
    """Producing, 29-bit and restricted identifiers are refused with 0609 0030."""
    assert master.abort_code(0x1005, 0, cob_id.to_bytes(4, "little")) == 0x06090030


@pytest.mark.parametrize("flags", [{"remote": True}, {"extended": True}])
def test_only_a_data_frame_is_a_sync(master: Master, flags: dict[str, bool]) -> None:
    """A remote or 29-bit frame of the same number is not the SYNC."""
    master.start()
    master.send(SYNC, **flags)
    assert master.data(TPDO4) == []


@pytest.mark.parametrize(
    ("value", "code"), [(0, 0), (1, 0x06090030), (2, 0), (240, 0), (241, 0x06090030)]
)
def test_counter_has_a_range(master: Master, value: int, code: int) -> None:
    """0x1019 is 0 or 2 to 240."""
    assert master.abort_code(0x1019, 0, bytes([value])) == code


def test_counter_is_locked_while_a_cycle_is_set(master: Master) -> None:
    """With 0x1006 not 0 the counter cannot be changed: 0800 0022."""
    master.remote.sdo[0x1006].raw = 10_000
    assert master.abort_code(0x1019, 0, b"\x0a") == 0x08000022


def test_counter_changes_the_length_of_sync(master: Master) -> None:
    """With a counter SYNC has one byte; SYNC without data is ignored."""
    master.remote.sdo[0x1019].raw = 10
    master.start()
    master.send(SYNC)
    assert master.data(TPDO4) == []
    master.send(SYNC, b"\x01")
    assert len(master.data(TPDO4)) == 1


def test_start_value_aligns_cyclic_tpdos(master: Master) -> None:
    """Type 2 with start value 3 answers the SYNCs 3, 5, 7, ... of a master counting to 10."""
    master.remote.sdo[0x1019].raw = 10
    master.remote.sdo[0x1803][1].raw = 1 << 31 | TPDO4
    master.remote.sdo[0x1803][2].raw = 2
    master.remote.sdo[0x1803][6].raw = 3
    master.remote.sdo[0x1803][1].raw = TPDO4
    master.start()
    answered = []
    for counter in [*range(1, 11), 1, 2]:
        before = len(master.data(TPDO4))
        master.send(SYNC, bytes([counter]))
        answered += [counter] * (len(master.data(TPDO4)) - before)
    assert answered == [3, 5, 7, 9, 1]


def test_start_value_is_locked_while_the_tpdo_exists(master: Master) -> None:
    """Sub-index 6 needs the TPDO deleted first."""
    assert master.abort_code(0x1803, 6, b"\x03") == 0x06090030


def test_window_drops_late_rpdos(master: Master) -> None:
    """A synchronous RPDO later than 0x1007 after its SYNC has no effect at the next."""
    master.remote.sdo[0x1400][2].raw = 1
    master.remote.sdo[0x1007].raw = 3000
    master.start()
    for wait, current in ((1, 0.002), (8, 0.003)):
        master.send(SYNC)
        master.run(wait)
        master.send(RPDO1, round(current * 1e9).to_bytes(4, "little"))
        master.send(SYNC)
        assert master.commands["valve_current"] == pytest.approx(0.002)
