"""The emulator inside a test: time, signals and error messages."""

from pathlib import Path
from typing import Any

import pytest

from hil_emulator.config.load import load_whole
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator, NeverHeldError


def test_time_advances_only_on_request(emulator: Emulator) -> None:
    """200 ms are 200 ticks; text and seconds are equivalent."""
    assert emulator.now == 0.0
    emulator.run_for("200 ms")
    assert emulator.rig.now_ns == 200_000_000
    emulator.run_for(0.1)
    assert emulator.rig.now_ns == 300_000_000


def test_waiting_returns_how_long_it_took(emulator: Emulator, wait_until: Any) -> None:
    """With a pulling load the rod passes a position after a time; text and function agree."""
    emulator.set("external_force", "-2 kN")
    took = wait_until("model.position > 40.05 mm", within="2 s")
    assert 0.0 < took < 2.0
    assert wait_until(lambda s: s.model.position > 40.05e-3) == 0.0


def test_a_condition_that_never_holds_fails_with_the_values(wait_until: Any) -> None:
    """The message names the condition, the time and the signals of the condition."""
    where = r"position = (40|39\.9)\S* mm"
    words = rf"position > 70 mm did not hold within 50 ms; at 0\.050 s {where}"
    with pytest.raises(NeverHeldError, match=words):
        wait_until("position > 70 mm", within="50 ms")


def test_an_unknown_signal_lists_the_available_ones(emulator: Emulator) -> None:
    """The message lists the signals, for an attribute and for a condition."""
    with pytest.raises(AttributeError, match="no signal 'speed'; there are time, valve_current"):
        _ = emulator.signals.speed
    with pytest.raises(UserError, match="no signal 'speed'"):
        emulator.wait_until("speed > 1 m/s")


def test_an_unknown_setting_lists_the_available_ones(emulator: Emulator) -> None:
    """The supply and the load can be set; a wrong unit is named."""
    with pytest.raises(UserError, match="there are supply_pressure, lines_closed"):
        emulator.set("temperature", "50 degC")
    with pytest.raises(UserError, match="a pressure is wanted"):
        emulator.set("supply_pressure", "50 mm")


def test_a_missing_wall_cannot_be_moved(emulator: Emulator) -> None:
    """The message for a machine without a wall states how to add one."""
    with pytest.raises(UserError, match="there is no wall to move"):
        emulator.set("wall_shift", "-5 mm")


@pytest.mark.slow
def test_a_wall_moves_to_its_set_position(tmp_path: Path) -> None:
    """With the valve closed oil holds the rod: 1e5 N/m compressed by 5 mm give 500 N."""
    layer = tmp_path / "wall.toml"
    layer.write_text('[load]\nwall = { stiffness = "1e5 N/m", distance = "40 mm" }\n')
    with Emulator(load_whole([shipped("configs/hyq_knee.toml"), layer])) as walled:
        walled.set("wall_shift", "-5 mm")
        walled.run_for("300 ms")
        moved = 0.04 - walled.signals.model.position
        pushed = walled.signals.model.resisting_force
        assert pushed == pytest.approx(1e5 * (5e-3 - moved), rel=1e-2)
        assert pushed > 300.0


@pytest.mark.emulator("configs/hyq_knee.toml", "configs/spring_load.toml", seed=7)
def test_the_marker_chooses_configuration_and_seed(emulator: Emulator) -> None:
    """Two files of the package, laid over each other, and another seed."""
    assert emulator.config.plant["load_spring_stiffness"] == 50e3
    assert emulator.config.seed == 7


def test_each_test_has_a_separate_bus(emulator: Emulator) -> None:
    """A second emulator in the same process receives no frames of the first one."""
    with Emulator(emulator.config) as other:
        emulator.run_for("5 ms")
        assert other.bus != emulator.bus
        assert other.recorder.frames == []


def test_a_python_can_bus_sends_and_receives(emulator: Emulator, can_bus: Any) -> None:
    """The boot-up message arrives; a frame sent now is received in the next tick."""
    import can

    emulator.tick()
    assert can_bus.recv(0).arbitration_id == 0x705
    can_bus.send(can.Message(arbitration_id=0, data=[1, 5], is_extended_id=False))
    emulator.tick()
    assert emulator.rig.nodes[0].state.name == "OPERATIONAL"
