"""The behaviour of the valve-controlled cylinder, against closed forms."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import record
from reference_machine import K_V, P_S, P_T, STEP, machine

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]

AREA, ALPHA = 2.0106e-4, 0.61
BETA, DEAD, STROKE = 1.3e9, 3e-6, 0.08

OIL_ALONE = {"entrained_air_fraction": 0.0, "coulomb_friction_force": 0.0}


@pytest.mark.parametrize("current", [2e-3, -2e-3])
def test_steady_speed_is_flow_over_area(current: float, make_plant: MakePlant) -> None:
    """A free rod settles where both chambers' flows, and the force balance, agree."""
    free = OIL_ALONE | {
        "viscous_friction_coefficient": 0.0,
        "load_viscous_friction_coefficient": 0.0,
        "load_mass": 2.0,
        "initial_position": 0.02 if current > 0 else 0.06,
    }
    plant = make_plant(machine(**free))
    plant.inputs.valve_current = current
    plant.step(round(0.12 / STEP))
    if current > 0:
        drop = (P_S - ALPHA * P_T) / (1 + ALPHA**3)
    else:
        drop = (ALPHA * P_S - P_T) / (1 + ALPHA**3)
    expected = K_V * current * math.sqrt(drop) / AREA
    assert plant.signals.velocity == pytest.approx(expected, rel=5e-3)
    assert plant.signals.flow_a / AREA == pytest.approx(plant.signals.velocity, rel=5e-3)
    assert plant.signals.flow_b / (ALPHA * AREA) == pytest.approx(plant.signals.velocity, rel=5e-3)


def test_small_motions_ring_at_the_hydraulic_resonance(make_plant: MakePlant) -> None:
    """With the valve shut, 50 kg on two 3 ml chambers ring at 60.5 Hz and decay as -15 1/s."""
    plant = make_plant(machine(**OIL_ALONE))
    plant.state.velocity = 1e-3
    (velocity,) = record(plant, 6000, "velocity")
    v_a, v_b = DEAD + AREA * 0.04, DEAD + ALPHA * AREA * 0.04
    stiffness = AREA**2 * BETA * (1 / v_a + ALPHA**2 / v_b)
    omega, decay = math.sqrt(stiffness / 50.0), 1500.0 / (2 * 50.0)
    rising = np.flatnonzero((velocity[:-1] < 0) & (velocity[1:] >= 0))
    share = velocity[rising] / (velocity[rising] - velocity[rising + 1])
    period = np.diff((rising + share) * STEP).mean()
    peaks = [velocity[a:b].max() for a, b in itertools.pairwise(rising)]
    rate = np.log(peaks[0] / peaks[-1]) / (period * (len(peaks) - 1))
    assert 1 / period == pytest.approx(60.5, rel=0.02)
    assert 2 * math.pi / period == pytest.approx(math.sqrt(omega**2 - decay**2), rel=2e-3)
    assert rate == pytest.approx(decay, rel=0.02)


def test_pressures_stay_physical_near_resonance(make_plant: MakePlant) -> None:
    """2 Hz at 1.5 mA with 50 Hz at 0.5 mA leaves every pressure between vacuum and 2 p_s."""
    plant = make_plant(machine())
    low, high = math.inf, 0.0
    for i in range(8000):
        t = i * 250e-6
        slow, fast = math.sin(2 * math.pi * 2 * t), math.sin(2 * math.pi * 50 * t)
        plant.inputs.valve_current = 1.5e-3 * slow + 0.5e-3 * fast
        plant.step(12)
        pressures = plant.signals.pressure_a, plant.signals.pressure_b
        low, high = min(low, *pressures), max(high, *pressures)
    assert low >= 0.0
    assert high <= 2 * P_S


@pytest.mark.parametrize("current", [2e-3, -2e-3])
def test_load_force_derivative_follows_the_printed_equation(
    current: float, make_plant: MakePlant
) -> None:
    """S1 eq. 3.20, one branch for each direction of the spool, holds along a trajectory."""
    values = machine(**OIL_ALONE, valve_laminar_width=1e3, valve_critical_reynolds_number=0.0)
    plant = make_plant(values)
    plant.inputs.valve_current = current
    plant.step(round(2e-3 / STEP))
    names = ("load_force", "spool_position", "pressure_a", "pressure_b", "position", "velocity")
    force, u, p_a, p_b, x, v = record(plant, 2000, *names)
    v_a, v_b = DEAD + AREA * x, DEAD + ALPHA * AREA * (STROKE - x)
    if current > 0:
        opening = np.sqrt(P_S - p_a) / v_a + ALPHA * np.sqrt(p_b - P_T) / v_b
    else:
        opening = np.sqrt(p_a - P_T) / v_a + ALPHA * np.sqrt(P_S - p_b) / v_b
    pumping = AREA * v * (1 / v_a + ALPHA**2 / v_b)
    friction_rate = 1000.0 * np.gradient(v, STEP)
    printed = AREA * BETA * (K_V * u * opening - pumping) - friction_rate
    measured = np.gradient(force, STEP)
    assert np.max(np.abs(printed - measured)[2:-2]) < 2e-3 * np.max(np.abs(measured))


def test_energy_is_neither_made_nor_lost(make_plant: MakePlant) -> None:
    """Supply energy = heat in valve and friction + load's work + kinetic + compression."""
    plant = make_plant(
        machine(
            entrained_air_fraction=0.0, valve_laminar_width=1e3, valve_critical_reynolds_number=0.0
        )
    )
    plant.inputs.valve_current = 3e-3
    names = (
        "supply_flow", "tank_flow", "valve_loss", "pressure_a", "pressure_b", "position",
        "velocity", "supply_pressure",
    )  # fmt: skip
    q_s, q_t, heat, p_a, p_b, x, v, _ = record(plant, 3000, *names)

    def total(power: np.ndarray) -> float:
        return float(np.trapezoid(power, dx=STEP))

    friction = (1000.0 * v + 100.0 * np.tanh(v / 1e-3)) * v + 500.0 * v**2
    v_a, v_b = DEAD + AREA * x, DEAD + ALPHA * AREA * (STROKE - x)
    compression = np.trapezoid(p_a * v_a / BETA, p_a) + np.trapezoid(p_b * v_b / BETA, p_b)
    kinetic = 25.0 * (v[-1] ** 2 - v[0] ** 2)
    supplied = total(P_S * q_s - P_T * q_t)
    assert supplied > 50.0
    assert total(heat) + total(friction) + compression + kinetic == pytest.approx(
        supplied, rel=1e-3
    )


def test_pressure_b_jumps_when_the_motion_reverses(make_plant: MakePlant) -> None:
    """An asymmetric cylinder needs other pressures for each direction: S1's a³, a² form.

    No load, vacuum in the tank: 29.5 and 48.5 bar extending, 79.5 and 130.5 bar retracting.
    """
    free = OIL_ALONE | {
        "viscous_friction_coefficient": 0.0,
        "load_viscous_friction_coefficient": 0.0,
        "load_mass": 2.0,
        "tank_pressure": 0.0,
    }
    pressures = []
    for current, start in ((2e-3, 0.02), (-2e-3, 0.06)):
        plant = make_plant(machine(**free, initial_position=start))
        plant.inputs.valve_current = current
        plant.step(round(0.12 / STEP))
        pressures += [plant.signals.pressure_a, plant.signals.pressure_b]
    assert pressures == pytest.approx([29.5e5, 48.5e5, 79.5e5, 130.5e5], rel=5e-3)
