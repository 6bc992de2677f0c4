"""The fixed-step integrator against an independent, exact solution of the printed equations."""

from collections.abc import Callable

import numpy as np
import pytest
from printed_equations import RANGES, Machine, trajectory
from reference_machine import machine

from hil_emulator.model.plant import Plant

TICK = 5e-3
CHANNELS = ("spool_position", "spool_speed", "pressure_a", "pressure_b", "position", "velocity")
FORCE_RANGE = 5000.0

CASES: dict[str, tuple[dict[str, float], dict[str, float], list[float]]] = {
    # name: (fields of Machine, the same as fields of the model, current of each tick)
    "mid-stroke": ({}, {}, [1e-3] * 5 + [-2e-3] * 5),
    "reversal with Stribeck friction": (
        {"m": 11.0, "f_s": 100.0},
        {"load_mass": 11.0, "stribeck_friction_excess": 100.0},
        [1e-3, 1e-3, -1e-3, -1e-3, 1e-3, 1e-3, -1e-3, -1e-3],
    ),
    "stalled at the stop with the valve fully open": (
        {"x_0": 0.0799},
        {"initial_position": 0.0799},
        [8e-3] * 8,
    ),
    "creeping through edges that are open at null": (
        {"u_0": 28e-6, "f_c": 0.0},
        {"underlap_lap": 28e-6, "coulomb_friction_force": 0.0},
        [2e-5, -4e-5, 1e-4, 0.0, -2e-4, 0.0, 0.0, 5e-5],
    ),
    "impact on the end stop": (
        {"x_0": 0.07},
        {"initial_position": 0.07},
        [3e-3] * 10,
    ),
    "air and an overrunning load": (
        {"r_air": 0.005, "force": -2500.0, "m": 11.0, "x_0": 0.06},
        {"entrained_air_fraction": 0.005, "load_mass": 11.0, "initial_position": 0.06},
        [2e-3] * 8,
    ),
    "cavitation in oil with little air": (
        {"force": -4000.0, "x_0": 0.02, "r_air": 1e-4},
        {"initial_position": 0.02, "entrained_air_fraction": 1e-4},
        [4e-3, 4e-3, 0.0, 0.0, 0.0, -4e-3, -4e-3, -4e-3],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_default_step_is_exact_to_a_thousandth_of_the_range(
    case: str, make_plant: Callable[..., Plant]
) -> None:
    """Position, velocity, pressures and load force follow Radau (rtol 1e-10) within 0.1 %."""
    hand, fields, currents = CASES[case]
    witness = Machine(**hand)
    expected = trajectory(witness, currents, TICK)
    plant = make_plant(machine(**fields))
    plant.inputs.external_force = witness.force
    worst = 0.0
    for current, exact in zip(currents, expected, strict=True):
        plant.inputs.valve_current = current
        plant.step(round(TICK / plant.step_width))
        state = np.array([plant.signals[name] for name in CHANNELS])
        force = plant.signals.load_force - witness.load_force(exact)
        errors = [*np.abs(state - exact[:-1]) / RANGES[:-1], abs(force) / FORCE_RANGE]
        worst = max(worst, *errors)
    print(f"{case}: {worst:.1e}")
    assert worst < 1e-3
