"""Machines of the package: each is stable and as fast as its data sheets state."""

import math
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.characterise.procedures import no_load
from hil_emulator.characterise.stand import Bench
from hil_emulator.commands.check import check
from hil_emulator.config.load import Configuration, load_rig
from hil_emulator.device.eds.load import load as load_eds
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.plant import Plant
from hil_emulator.model.stability import required_step
from hil_emulator.platform.packaged import packaged
from hil_emulator.platform.paths import shipped

WORKED = ("excavator_boom", "micro_rig", "press", "test_axis")


@pytest.fixture(params=WORKED)
def config(request: pytest.FixtureRequest) -> Configuration:
    """Return one machine after the other."""
    return load_rig([packaged()[request.param]])


def test_the_stated_step_is_safe(config: Configuration, model: Kernel) -> None:
    """`check` has nothing to warn of."""
    assert config.step <= required_step(model, config.plant)


def test_it_extends_at_the_speed_of_its_valve(config: Configuration, model: Kernel) -> None:
    """Full current, a supply that holds: q² (1 + alpha³) = K_v² u² (p_s - alpha p_t - F/A_p).

    F is friction and weight; the mean speed over the second half of the way.
    """
    held = {"fixed_pump_flow": math.inf, "variable_pump_flow": math.inf}
    plant = Plant(model, config.plant | held, config.step)
    par = plant.parameters
    plant.state.position = 0.1 * par.cylinder_stroke
    plant.inputs.valve_current = par.current_saturation_limit
    rows = []
    while plant.signals.position < 0.8 * par.cylinder_stroke:
        plant.step(50)
        rows.append((plant.signals.velocity, plant.signals.friction_force))
        assert len(rows) < 20_000
    velocity, friction = np.mean(rows[len(rows) // 2 :], axis=0)
    alpha, area = par.cylinder_area_ratio, par.cylinder_piston_area
    force = friction + config.plant.get("gravity_force", 0.0)
    drop = par.supply_pressure - alpha * par.tank_pressure - force / area
    opening = par.current_saturation_limit + par.land_leakage_clearance
    flow = par.valve_gain * opening * math.sqrt(drop / (1.0 + alpha**3))
    # on which side of its loop the spool has come to stand, the data sheet leaves open
    loop = 0.5 * par.hysteresis_width + par.threshold_current
    assert velocity == pytest.approx(flow / area, rel=0.01 + loop / opening)


def test_a_free_rod_has_the_pressures_of_its_areas(model: Kernel) -> None:
    """Edges so small that their flow is partly laminar: the bench compares turbulent flow."""
    config = load_rig([packaged()["micro_rig"]])
    bench = Bench(model, config.plant, config.sensors, step=config.step)
    assert all(comparison.agrees for comparison in no_load.run(bench).comparisons)


def test_its_node_can_say_all_that_happens(config: Configuration) -> None:
    """Sensors' ranges, and the valve's current, fit into the objects of the EDS."""
    (node,) = config.nodes
    entries = {entry.name: entry for entry in load_eds(node.eds, node.id).entries}
    assert entries["valve_current"].high * 1e-9 >= config.plant["current_saturation_limit"]
    for channel, values in config.sensors.items():
        if "measuring_range_upper" in values:
            entry = entries[channel]
            reach = entry.type.high * entry.factor
            assert reach > values["measuring_range_upper"], channel
            assert -reach < values["measuring_range_lower"], channel


def test_the_eds_for_400_bar_differs_in_its_digits_alone() -> None:
    """The package's EDS is the truth about everything else."""
    usual = shipped("eds/hydraulic_actuator.eds").read_text().splitlines()
    wide = Path(shipped("configs/hydraulic_actuator_400_bar.eds")).read_text().splitlines()
    changed = [(a, b) for a, b in zip(usual, wide, strict=True) if a != b]
    assert changed[0] == (
        "FileName=hydraulic_actuator.eds", "FileName=hydraulic_actuator_400_bar.eds"
    )  # fmt: skip
    assert changed[1:] == [("Factor=1000", "Factor=2000")] * 3


@pytest.mark.slow
def test_check_says_no_warning(capsys: pytest.CaptureFixture[str]) -> None:
    """The command itself, machine by machine."""
    for name in WORKED:
        check([packaged()[name]])
    assert "warning" not in capsys.readouterr().out


def test_a_lift_shows_its_friction_as_the_rig_of_the_document_does(model: Kernel) -> None:
    """F_f = p_a A - m (g + a), the rod side at the tank, is B v + F_c at steady speed (S2 eq. 8).

    The supply pressure is commanded; each one gives a speed, and a load too heavy stays below.
    """
    config = load_rig([packaged()["single_acting_lift"]])
    assert config.step <= required_step(model, config.plant)
    area, speeds = 12.57e-4, []
    for pressure in (25e5, 36e5, 44e5):
        plant = Plant(model, config.plant | {"supply_pressure": pressure}, config.step)
        plant.inputs.valve_current = 10e-3
        plant.step(round(0.8 / config.step))
        s = plant.signals
        speeds.append(s.velocity)
        friction = s.pressure_a * area - 400.0 * (9.80665 + s.acceleration)
        if pressure > 30e5:
            expected = 3000.0 * s.velocity + 250.0 + 150.0 * math.exp(-s.velocity / 0.01)
            assert friction == pytest.approx(expected, rel=0.03)
    assert speeds[0] == pytest.approx(0.0, abs=1e-3)
    assert 0.05 < speeds[1] < speeds[2]
