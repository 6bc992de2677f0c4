"""The node as the producer of SYNC (CiA 301 7.2.5)."""

import itertools

import pytest
from device_master import SYNC, TPDO2, Master

PRODUCE = 0x4000_0080


def produced(master: Master, milliseconds: int) -> list[bytes]:
    """Return the data of all SYNCs in the next `milliseconds`."""
    master.forget()
    master.run(milliseconds)
    return master.data(SYNC)


@pytest.fixture
def producer(master: Master) -> Master:
    """Return a node that produces SYNC each 10 ms."""
    master.remote.sdo[0x1006].raw = 10_000
    master.remote.sdo[0x1005].raw = PRODUCE
    return master


def test_sync_has_its_period(producer: Master) -> None:
    """A SYNC each cycle period, also in PRE-OPERATIONAL."""
    assert produced(producer, 100) == [b""] * 10
    times = producer.times_ms(SYNC)
    assert {b - a for a, b in itertools.pairwise(times)} == {10.0}


def test_no_period_no_sync(producer: Master) -> None:
    """0x1006 = 0 stops the producer."""
    producer.remote.sdo[0x1006].raw = 0
    assert produced(producer, 50) == []


def test_a_stopped_node_is_silent(producer: Master) -> None:
    """SYNC is produced only in PRE-OPERATIONAL and OPERATIONAL."""
    producer.nmt(2)
    assert produced(producer, 50) == []
    producer.nmt(128)
    assert len(produced(producer, 50)) in (4, 5)


def test_own_sync_drives_own_pdos(producer: Master) -> None:
    """A synchronous TPDO follows the SYNC of its own node, in the same tick."""
    producer.remote.sdo[0x1801][1].raw = 1 << 31 | TPDO2
    producer.remote.sdo[0x1801][2].raw = 2
    producer.remote.sdo[0x1801][1].raw = TPDO2
    producer.start()
    producer.run(100)
    assert len(producer.data(TPDO2)) == 5
    assert set(producer.times_ms(TPDO2)) <= set(producer.times_ms(SYNC))


def test_counter_counts_up_to_its_overflow_value(master: Master) -> None:
    """With 0x1019 = 3 the data are 1, 2, 3, 1 and so on."""
    master.remote.sdo[0x1019].raw = 3
    master.remote.sdo[0x1006].raw = 5_000
    master.remote.sdo[0x1005].raw = PRODUCE
    master.forget()
    master.run(31)
    assert [data[0] for data in master.data(SYNC)] == [1, 2, 3, 1, 2, 3]


def test_identifier_is_locked_while_producing(producer: Master) -> None:
    """It can be changed once the node no longer produces (CiA 301 7.5.2.5)."""
    assert producer.abort_code(0x1005, 0, (0x4000_0081).to_bytes(4, "little")) == 0x06090030
    producer.remote.sdo[0x1005].raw = 0x80
    assert produced(producer, 50) == []
    producer.remote.sdo[0x1005].raw = 0x90


def test_reset_stops_producing(producer: Master) -> None:
    """By default no node produces SYNC."""
    producer.nmt(130)
    assert produced(producer, 50) == []
