"""The tables of a node before it runs: bindings, PDOs, bus load."""

import pytest
from device_master import NODE_ID

from hil_emulator.device.bus_load import frame_bits
from hil_emulator.device.node import Node


@pytest.mark.parametrize("size", range(9))
def test_longest_frame(size: int) -> None:
    """A classical base frame takes at most 55 + 10 s bits (Davis et al. 2007)."""
    assert frame_bits(size) == 55 + 10 * size


def test_bindings_name_every_source(node: Node) -> None:
    """Each object from 0x2000 on is listed with its source."""
    table = {row.name: (row.unit, row.factor, row.bound_to) for row in node.bindings()}
    assert table["pressure_a"] == ("Pa", 1000.0, "channel pressure_a")
    assert table["valve_current"] == ("A", 1e-9, "command valve_current")
    assert table["valve_current_safe"] == ("A", 1e-9, "safe value of valve_current")
    assert table["sample_counter"] == ("", 1.0, "device")
    assert len(table) == 10


def test_pdo_map_shows_the_defaults(node: Node) -> None:
    """Each PDO is listed with its identifier, type and entries."""
    rows = {row.name: row for row in node.pdo_map()}
    assert list(rows) == ["RPDO1", "TPDO1", "TPDO2", "TPDO3", "TPDO4"]
    assert rows["RPDO1"].entries == ("valve_current",)
    assert rows["RPDO1"].event_timer_ms == 20
    assert rows["TPDO4"].can_id == 0x480 + NODE_ID
    assert rows["TPDO4"].transmission_type == 1
    assert rows["TPDO4"].entries == ("position", "load_force")


def test_bus_load_counts_each_period(node: Node) -> None:
    """The load is the sum of TPDO1 to 3 per 1 ms, RPDO1 per 10 ms and heartbeat per 100 ms."""
    periodic = 1000 * (135 + 115 + 115) + 100 * 95 + 10 * 65
    assert node.bus_load(sync_us=0) == pytest.approx(periodic)
    more = 500 * (55 + 135 + 95) - 100 * 95  # SYNC, TPDO4 and RPDO1 at 500 Hz
    assert node.bus_load(sync_us=2000) == pytest.approx(periodic + more)


def test_ticks_longer_than_timers_bound_the_load(node: Node) -> None:
    """With ticks of 10 ms a TPDO with a timer of 1 ms is sent every 10 ms."""
    assert node.bus_load(sync_us=0, tick_us=10_000) == pytest.approx(
        100 * (135 + 115 + 115) + 100 * 95 + 10 * 65
    )
