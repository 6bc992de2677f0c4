"""Ten tests of a controller against the emulator, as its authors would write them."""

from typing import Any

import pytest
from controller import Controller, State


def test_it_starts_the_node_after_its_boot_up(controller: Controller, emulator: Any) -> None:
    """Ten milliseconds after power-on the node is OPERATIONAL and gets set points."""
    emulator.run_for("10 ms")
    assert emulator.rig.nodes[0].state.name == "OPERATIONAL"
    assert controller.state is State.HOLDING


def test_a_step_settles_fast_and_without_much_overshoot(
    holding: Controller, run_for: Any, wait_until: Any, emulator: Any
) -> None:
    """10 mm: within 5 % in 400 ms, at most 10 % too far."""
    holding.target = 0.05
    assert wait_until("model.position > 49.5 mm", within="400 ms") < 0.3
    run_for("400 ms")
    travelled = emulator.recorder.table()["model.position"]
    assert travelled.max() < 0.051
    assert abs(emulator.signals.model.position - 0.05) < 0.0005


def test_it_closes_the_valve_when_the_heartbeat_stops(
    holding: Controller, wait_until: Any, inject: Any
) -> None:
    """PDOs go on, but a node without heartbeat is not to be trusted."""
    with inject("node", "heartbeat_stop"):
        wait_until(lambda s: holding.state is State.SAFE, within="60 ms")
    assert holding.reason == "no heartbeat"
    assert holding.current == 0.0


def test_it_closes_the_valve_when_the_position_sensor_breaks(
    holding: Controller, wait_until: Any, inject: Any, emulator: Any
) -> None:
    """The node reports that the sensor is below its range; the rod stays in place."""
    with inject("position", "off"):
        wait_until(lambda s: holding.state is State.SAFE, within="5 ms")
        emulator.run_for("100 ms")
    assert holding.reason == "emergency FF13"
    assert abs(emulator.signals.model.position - 0.04) < 0.001


def test_it_notices_a_stuck_position(
    holding: Controller, wait_until: Any, inject: Any, emulator: Any
) -> None:
    """A reading that stays although the valve is open cannot be right; the rod does not run off."""
    with inject("position", "stuck"):
        holding.target = 0.05
        wait_until(lambda s: holding.state is State.SAFE, within="200 ms")
        emulator.run_for("50 ms")
    assert holding.reason == "the position does not move"
    assert emulator.signals.model.position < 0.06


def test_it_refuses_another_mapping(holding: Controller, network: Any, wait_until: Any) -> None:
    """A colleague maps the force alone into TPDO2: that is no position."""
    tpdo = network[holding.node].tpdo[2]
    tpdo.read()
    tpdo.clear()
    tpdo.add_variable("load_force")
    tpdo.save()
    wait_until(lambda s: holding.state is State.SAFE, within="20 ms")
    assert holding.reason == "TPDO2 has another mapping"


def test_it_stops_at_an_emergency(holding: Controller, wait_until: Any, inject: Any) -> None:
    """An over-temperature that the node reports ends the motion at once."""
    holding.target = 0.06
    with inject("node", "emcy", code="0x4210"):
        wait_until(lambda s: holding.state is State.SAFE, within="5 ms")
    assert holding.reason == "emergency 4210"
    wait_until(lambda s: s.valve_current == 0.0, within="5 ms")


def test_it_rides_through_lost_samples(holding: Controller, run_for: Any, inject: Any) -> None:
    """With a fifth of the position PDOs lost it still arrives, and it has counted them."""
    with inject("tpdo2", "drop", probability=0.2, seed=3):
        holding.target = 0.05
        run_for("400 ms")
    assert holding.state is State.HOLDING
    assert 50 < holding.missed < 110
    assert holding._position == pytest.approx(0.05, abs=0.0005)


def test_it_rides_through_a_supply_drop(
    holding: Controller, wait_until: Any, inject: Any, emulator: Any
) -> None:
    """Half the pressure for 100 ms in the middle of a step: late, but there."""
    holding.target = 0.06
    with inject("supply", "droop", drop="80 bar", duration="100 ms", ramp="10 ms"):
        took = wait_until("model.position > 59 mm", within="600 ms")
    assert took > 0.1
    assert holding.state is State.HOLDING


def test_it_takes_a_restarted_node_back(
    holding: Controller, run_for: Any, inject: Any, emulator: Any
) -> None:
    """After a dip of the node's supply the position is held again, with fresh counters."""
    holding.target = 0.045
    run_for("50 ms")
    with inject("node", "reset"):
        run_for("400 ms")
    assert holding.state is State.HOLDING
    assert holding.missed == 0
    assert abs(emulator.signals.model.position - 0.045) < 0.0005
