"""The SYNC consumer's COB-ID (CiA 301 7.5.2.5)."""

import pytest
from device_master import SYNC, TPDO4, Master


def test_stock_producer_is_heard(master: Master) -> None:
    """The stock SYNC producer triggers the synchronous TPDO."""
    master.start()
    master.network.sync.transmit()
    assert len(master.data(TPDO4)) == 1


def test_sync_can_be_moved(master: Master) -> None:
    """After a write of 0x1005 the node hears the new identifier and not the old."""
    master.remote.sdo[0x1005].raw = 0x0A0
    master.start()
    master.send(SYNC)
    assert master.data(TPDO4) == []
    master.send(0x0A0)
    assert len(master.data(TPDO4)) == 1


@pytest.mark.parametrize("cob_id", [1 << 30 | 0x80, 1 << 29 | 0x80, 0x001, 0x000, 0x601])
def test_sync_cannot_be_produced_nor_hidden(master: Master, cob_id: int) -> None:
    """Producing, 29-bit and restricted identifiers are refused with 0609 0030."""
    assert master.abort_code(0x1005, 0, cob_id.to_bytes(4, "little")) == 0x06090030


@pytest.mark.parametrize("flags", [{"remote": True}, {"extended": True}])
def test_only_a_data_frame_is_a_sync(master: Master, flags: dict[str, bool]) -> None:
    """A remote or 29-bit frame of the same number is not the SYNC."""
    master.start()
    master.send(SYNC, **flags)
    assert master.data(TPDO4) == []
