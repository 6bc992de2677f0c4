"""The TIME consumer with a stock producer, and the TIME producer (CiA 301 7.2.6)."""

import pytest
from device_master import Master

DAY_S = 86_400
EPOCH_1984_S = 441_763_200
"""1 January 1984 in Unix time, where TIME_OF_DAY begins."""


def network_time(master: Master) -> tuple[int, int]:
    """Return days since 1984 and milliseconds since midnight."""
    data = master.remote.sdo.upload(0x2042, 0)
    return int.from_bytes(data[4:], "little"), int.from_bytes(data[:4], "little")


def test_stock_producer_sets_the_time(master: Master) -> None:
    """The object shows the last TIME message."""
    master.network.time.transmit(EPOCH_1984_S + 3 * DAY_S + 12.5)
    assert network_time(master) == (3, 12_500)


@pytest.mark.parametrize("data", [b"", bytes([1] * 5), bytes([1] * 7)])
def test_other_lengths_are_ignored(master: Master, data: bytes) -> None:
    """TIME has six bytes."""
    master.send(0x100, data)
    assert network_time(master) == (0, 0)


def test_reserved_bits_do_not_count(master: Master) -> None:
    """The upper four bits of the milliseconds are ignored."""
    master.send(0x100, b"\x01\0\0\xf0\x02\0")
    assert network_time(master) == (2, 1)


def test_consuming_can_be_switched_off(master: Master) -> None:
    """With bit 31 of 0x1012 clear TIME is ignored."""
    master.remote.sdo[0x1012].raw = 0x100
    master.network.time.transmit(EPOCH_1984_S + DAY_S)
    assert network_time(master) == (0, 0)


def test_time_is_produced_once_a_second(master: Master) -> None:
    """With bit 30 of 0x1012 the node sends the time, starting at 1984."""
    master.remote.sdo[0x1012].raw = 0x4000_0100
    master.run(2100)
    assert len(master.data(0x100)) == 2
    first, second = (int.from_bytes(data[:4], "little") for data in master.data(0x100))
    assert second - first == 1000
    assert master.data(0x100)[0][4:] == b"\0\0"


def test_produced_time_continues_from_the_received_time(master: Master) -> None:
    """A node that has received TIME continues from it, also past midnight."""
    master.network.time.transmit(EPOCH_1984_S + 3 * DAY_S - 0.5)
    master.remote.sdo[0x1012].raw = 0x4000_0100
    master.run(1100)
    (data,) = master.data(0x100)
    assert int.from_bytes(data[4:], "little") == 3
    assert 400 < int.from_bytes(data[:4], "little") < 700


def test_a_produced_time_keeps_its_identifier(master: Master) -> None:
    """While TIME is produced it can be switched off, but its identifier is locked."""
    master.remote.sdo[0x1012].raw = 0x4000_0100
    assert master.abort_code(0x1012, 0, (0x4000_0101).to_bytes(4, "little")) == 0x06090030
    master.remote.sdo[0x1012].raw = 0x8000_0100
    master.run(1100)
    assert master.data(0x100) == []
