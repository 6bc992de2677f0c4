"""A stock `canopen.Network` in lock-step."""

import struct
from typing import Any

import pytest
from canopen import SdoAbortedError

from hil_emulator.simulation.emulator import Emulator


def test_a_stock_master_reads_and_writes_objects(network: Any) -> None:
    """The node is known by its EDS; SDO works in both directions, segmented too."""
    node = network[5]
    assert node.sdo["Manufacturer device name"].raw == "Hydraulic actuator emulator"
    node.sdo[0x1017].raw = 50
    assert node.sdo[0x1017].raw == 50
    with pytest.raises(SdoAbortedError):
        _ = node.sdo.upload(0x5FFF, 0)


def test_an_exchange_takes_emulator_time_only(network: Any, emulator: Emulator) -> None:
    """Each frame of the master is one tick."""
    before = emulator.rig.now_ns
    _ = network[5].sdo[0x1000].raw
    assert emulator.rig.now_ns == before + emulator.config.tick_ns


def test_pdos_arrive_in_the_stock_node(network: Any, emulator: Emulator) -> None:
    """After the start TPDO2 holds the position, and heartbeats the state."""
    node = network[5]
    node.tpdo.read()
    node.nmt.state = "OPERATIONAL"
    emulator.run_for("10 ms")
    assert node.tpdo[2]["position"].phys == pytest.approx(emulator.signals.position, abs=1e-6)


def test_a_periodic_frame_keeps_emulator_time(network: Any, emulator: Emulator) -> None:
    """A set point each 10 ms for 100 ms is ten frames; updated and stopped it obeys."""
    network[5].nmt.state = "OPERATIONAL"
    emulator.recorder.frames.clear()
    task = network.send_periodic(0x205, struct.pack("<i", 100_000), 0.01)
    emulator.run_for("100 ms")
    task.update(struct.pack("<i", 200_000))
    emulator.run_for("20 ms")
    task.stop()
    emulator.run_for("100 ms")
    data = [f.data for _, sent, f in emulator.recorder.frames if not sent and f.can_id == 0x205]
    values = [struct.unpack("<i", d)[0] for d in data]
    assert values[:10] == [100_000] * 10
    assert 11 <= len(values) <= 13
    assert values[-1] == 200_000


def test_a_callback_may_send(network: Any, emulator: Emulator) -> None:
    """A frame sent from within a tick waits for the next one."""
    network[5].nmt.state = "OPERATIONAL"
    network.subscribe(0x285, lambda *a: network.send_message(0x205, struct.pack("<i", 300_000)))
    emulator.run_for("5 ms")
    assert emulator.signals.valve_current == pytest.approx(3e-4)
