"""The physics of leakage, ends of stroke, rod mass and seal friction."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import record, settle
from reference_machine import STEP, ballistic, bare, machine, pond
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from hil_emulator.model.effects.friction import film_lag
from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
AREA, ALPHA = 2.0106e-4, 0.61


def friction_at(plant: Plant, velocity: float) -> float:
    """Friction force while the rod moves at a velocity [N]."""
    plant.state.velocity = velocity
    plant.step(0)
    return float(plant.signals.friction_force)


def test_internal_leakage_equalises_the_chambers(make_plant: MakePlant) -> None:
    """0.16 l/min at 160 bar; a difference decays as exp(-C beta (1/v_a + 1/v_b) t)."""
    conductance = 1.7e-13
    assert conductance * 160e5 * 60e3 == pytest.approx(0.16, rel=0.03)
    plant = make_plant(bare(internal_leakage_conductance=conductance, load_mass=1e5,
                            initial_position=0.04))  # fmt: skip
    plant.set_pressures(100e5, 20e5)
    difference = []
    for _ in range(50):
        plant.inputs.external_force = plant.signals.hydraulic_force
        plant.step(50)
        difference.append(float(plant.signals.pressure_a - plant.signals.pressure_b))
    v_a, v_b = 3e-6 + AREA * 0.04, 3e-6 + ALPHA * AREA * 0.04
    rate = conductance * 1.3e9 * (1 / v_a + 1 / v_b)
    assert difference[-1] == pytest.approx(80e5 * math.exp(-rate * 0.05), rel=0.01)


def test_external_leakage_empties_each_chamber_towards_the_air(make_plant: MakePlant) -> None:
    """Pressure over atmosphere decays as exp(-C beta t/v) in each chamber by itself."""
    conductance = 2e-13
    plant = make_plant(bare(external_leakage_conductance=conductance, load_mass=1e5))
    plant.set_pressures(100e5, 20e5)
    for _ in range(50):
        plant.inputs.external_force = plant.signals.hydraulic_force
        plant.step(50)
    air = 101_325.0
    for pressure, start, volume in (
        (plant.signals.pressure_a, 100e5, 3e-6 + AREA * 0.04),
        (plant.signals.pressure_b, 20e5, 3e-6 + ALPHA * AREA * 0.04),
    ):
        left = (start - air) * math.exp(-conductance * 1.3e9 / volume * 0.05)
        assert pressure - air == pytest.approx(left, rel=0.01)


@pytest.mark.parametrize(("end", "direction"), [(0.08, 1), (0.0, -1)])
def test_end_stops_yield_as_a_spring_and_never_pull(
    end: float, direction: int, make_plant: MakePlant
) -> None:
    """Pressed by 1000 N the rod rests F/k beyond the end; struck at 0.5 m/s it leaves slower."""
    plant = make_plant(ballistic(end_stops_stiffness=1e8, initial_position=end,
                                 viscous_friction_coefficient=1e4))  # fmt: skip
    plant.inputs.external_force = -1000.0 * direction
    settle(plant, 0.5)
    assert (plant.signals.position - end) * direction == pytest.approx(1e-5, rel=1e-3)
    plant = make_plant(ballistic(end_stops_stiffness=1e8, end_stops_damping=0.4,
                                 initial_position=end - 1e-3 * direction))  # fmt: skip
    plant.state.velocity = 0.5 * direction
    force, velocity = record(plant, 400, "stop_force", "velocity")
    assert np.all(force * direction <= 0.0)
    # Hunt and Crossley 1975: e = 1 - (2/3) c v, for small c v
    assert -velocity[-1] * direction / 0.5 == pytest.approx(1 - 2 / 3 * 0.4 * 0.5, rel=0.03)


def test_cushion_brakes_on_the_way_in_alone(make_plant: MakePlant) -> None:
    """Speed falls as exp(-c d²/(2 M l)) with depth d; on the way out nothing brakes."""
    plant = make_plant(ballistic(cushion_coefficient=5000.0, initial_position=0.074))
    plant.state.velocity = 0.2
    position, velocity = record(plant, 1600, "position", "velocity")
    depth = position[-1] - 0.075
    assert 0.002 < depth < 0.005
    expected = 0.2 * math.exp(-5000.0 * depth**2 / (2 * 50.0 * 5e-3))
    assert velocity[-1] == pytest.approx(expected, rel=1e-4)
    plant.state.velocity = -0.2
    settle(plant, 0.01)
    assert plant.signals.velocity == pytest.approx(-0.2, rel=1e-6)


def test_rod_mass_is_not_in_the_load_cell_reading(make_plant: MakePlant) -> None:
    """f_h = f + m_p a while friction is off; the cell carries the load's share alone."""
    plant = make_plant(bare(rod_mass_mass=5.0))
    plant.inputs.valve_current = 2e-3
    f_h, f, a = record(plant, 2000, "hydraulic_force", "load_force", "acceleration")
    assert f_h - f == pytest.approx(5.0 * a, abs=1e-6)
    assert f == pytest.approx(50.0 * a, abs=1e-6)
    assert np.abs(5.0 * a).max() > 20.0


def test_viscous_friction_slows_exponentially(make_plant: MakePlant) -> None:
    """A free mass slows as exp(-B t/M)."""
    plant = make_plant(ballistic(viscous_friction_coefficient=1000.0))
    plant.state.velocity = 0.3
    settle(plant, 0.05)
    assert plant.signals.velocity == pytest.approx(0.3 * math.exp(-1000 / 50 * 0.05), rel=1e-6)


def test_coulomb_friction_stops_a_mass_in_finite_time(make_plant: MakePlant) -> None:
    """Deceleration is F_c/M, whatever the speed; then the mass stays."""
    plant = make_plant(ballistic(coulomb_friction_force=100.0))
    plant.state.velocity = 0.1
    settle(plant, 0.025)
    assert plant.signals.velocity == pytest.approx(0.05, rel=1e-3)
    settle(plant, 0.3)
    assert abs(plant.signals.velocity) < 1e-6


def test_stribeck_friction_is_an_excess_that_fades_with_speed(make_plant: MakePlant) -> None:
    """S1 Fig. 3.8: breakaway 200 N = 100 N + 100 N; the excess falls to 1/e at C_s."""
    plant = make_plant(bare(coulomb_friction_force=100.0, stribeck_friction_excess=100.0))
    speeds = np.array([-0.02, 0.02, 0.2])
    forces = [friction_at(plant, v) for v in speeds]
    assert forces[:2] == pytest.approx([-100 - 100 / math.e, 100 + 100 / math.e], rel=1e-6)
    assert forces[2] == pytest.approx(100.0, rel=1e-3)
    peak = max(friction_at(plant, v) for v in np.geomspace(1e-4, 1e-2, 50))
    assert 170.0 < peak < 200.0


def test_pressure_friction_follows_the_sum_of_pressures(make_plant: MakePlant) -> None:
    """3 mm² times (p_a + p_b): 3e-6 m² times 160 bar gives 48 N."""
    plant = make_plant(bare(pressure_friction_area=3e-6))
    assert friction_at(plant, 0.1) == pytest.approx(3e-6 * 160e5, rel=1e-6)
    plant.set_pressures(20e5, 30e5)
    assert friction_at(plant, -0.1) == pytest.approx(-3e-6 * 50e5, rel=1e-6)


STICKING: dict[str, tuple[dict[str, float], float]] = {
    # name: (friction, breakaway force against extension [N])
    "Coulomb": ({"coulomb_friction_force": 100.0}, 100.0),
    "Stribeck": ({"coulomb_friction_force": 60.0, "stribeck_friction_excess": 40.0}, 100.0),
    "pressure": ({"pressure_friction_area": 5e-6}, 5e-6 * 160e5),
    "asymmetry": ({"coulomb_friction_force": 100.0, "friction_asymmetry_asymmetry": -0.1}, 110.0),
}


@pytest.mark.parametrize("kind", STICKING)
def test_a_rod_sticks_below_breakaway_and_moves_above(kind: str, make_plant: MakePlant) -> None:
    """Half of breakaway bends the seals by micrometres and moves the rod no further, ever."""
    friction, breakaway = STICKING[kind]
    plant = make_plant(ballistic(**friction))
    start = float(plant.state.position)
    plant.inputs.external_force = 0.5 * breakaway
    settle(plant, 1.0)
    held = float(plant.state.position)
    assert 1e-6 < start - held < 3e-5
    assert plant.signals.friction_force == pytest.approx(-0.5 * breakaway, rel=1e-9)
    settle(plant, 5.0)
    assert float(plant.state.position) == pytest.approx(held, abs=1e-12)
    plant.inputs.external_force = 1.02 * breakaway
    settle(plant, 0.5)
    assert start - float(plant.state.position) > 1e-3


def test_seals_bend_by_the_presliding_distance(make_plant: MakePlant) -> None:
    """F = F_c tanh(x/d): at 76 % of Coulomb friction the rod has moved by d, and comes back."""
    plant = make_plant(ballistic(coulomb_friction_force=100.0, friction_presliding_distance=3e-5))
    start = float(plant.state.position)
    plant.inputs.external_force = -100.0 * math.tanh(1.0)
    settle(plant, 2.0)
    assert float(plant.state.position) - start == pytest.approx(3e-5, rel=1e-6)
    plant.inputs.external_force = 0.0
    settle(plant, 2.0)
    assert float(plant.state.position) == pytest.approx(start, abs=1e-12)


def test_a_load_that_varies_below_breakaway_moves_nothing(make_plant: MakePlant) -> None:
    """Dupont et al. 2002: where plain LuGre ratchets on, elastic seals return each time."""
    plant = make_plant(ballistic(coulomb_friction_force=100.0))
    places = []
    for _ in range(40):
        for phase in range(50):
            plant.inputs.external_force = -50.0 - 40.0 * math.sin(2 * math.pi * phase / 50)
            plant.step(100)
        places.append(float(plant.state.position))
    assert np.ptp(places[5:]) < 1e-11


def test_no_shipped_actuator_creeps_against_its_friction(make_plant: MakePlant) -> None:
    """The knee with its valve shut: pushed by half of Coulomb friction it stands still."""
    plant = make_plant(machine())
    plant.inputs.external_force = -50.0
    settle(plant, 1.0)
    held = float(plant.state.position)
    settle(plant, 5.0)
    assert float(plant.state.position) == pytest.approx(held, abs=1e-11)


def test_film_lag_fades_after_a_step_of_speed(make_plant: MakePlant) -> None:
    """F/F_0 = 1 + k (v - v_f)/(v + v_f + v_t) with v_f = v_2 + (v_1 - v_2) exp(-t/tau)."""
    plant = make_plant(ballistic(viscous_friction_coefficient=1000.0, film_lag_strength=0.3,
                                 film_lag_time_constant=0.03, load_mass=1e5))  # fmt: skip
    plant.state.velocity = 0.1
    settle(plant, 0.6)
    v_1 = float(plant.signals.velocity)
    assert friction_at(plant, v_1) == pytest.approx(1000.0 * v_1, rel=1e-3)
    for v_2 in (0.2, 0.05):
        plant.state.velocity, plant.state.film_lag_speed = v_2, v_1
        settle(plant, 0.02)
        film = v_2 + (v_1 - v_2) * math.exp(-0.02 / 0.03)
        share = 1 + 0.3 * (v_2 - film) / (v_2 + film + 1e-3)
        v = float(plant.signals.velocity)
        assert plant.signals.friction_force == pytest.approx(1000.0 * v * share, rel=1e-3)


@pytest.mark.parametrize("asymmetry", [0.0, 0.3, 1.0, -0.3])
def test_asymmetry_widens_the_loop_of_film_lag_in_one_direction(asymmetry: float) -> None:
    """The lag's share is k (1 + a)/(1 + |a|) where the rod extends, else with 1 - a."""

    def share(velocity: float) -> float:
        return film_lag(1.0, velocity, 0.0, 0.3, 0.05, asymmetry, 1e-9)[0] - 1.0

    whole = 1.0 + abs(asymmetry)
    assert share(0.2) == pytest.approx(0.3 * (1.0 + asymmetry) / whole, rel=1e-6)
    assert share(-0.2) == pytest.approx(0.3 * (1.0 - asymmetry) / whole, abs=1e-6)


def test_dahl_friction_follows_an_exponential_of_the_distance(make_plant: MakePlant) -> None:
    """After a reversal F/F_c = -(1 - 2 exp(-x/d)), at any speed."""
    distance = 2e-5
    for speed in (1e-3, 1e-2):
        plant = make_plant(ballistic(coulomb_friction_force=100.0, dahl_friction_share=1.0,
                                     friction_presliding_distance=distance,
                                     load_mass=1e6))  # fmt: skip
        plant.state.velocity = speed
        settle(plant, 10.0 * distance / speed)
        assert plant.signals.friction_force == pytest.approx(100.0, rel=1e-3)
        plant.state.velocity, turned = -speed, float(plant.state.position)
        settle(plant, distance / speed)
        way = turned - float(plant.state.position)
        expected = -100.0 * (1.0 - 2.0 * math.exp(-way / distance))
        assert plant.signals.friction_force == pytest.approx(expected, rel=5e-3)


def test_friction_asymmetry_is_the_ratio_of_both_directions(make_plant: MakePlant) -> None:
    """Friction out over friction in is (1 + k)/(1 - k)."""
    plant = make_plant(bare(viscous_friction_coefficient=1000.0, coulomb_friction_force=100.0,
                            friction_asymmetry_asymmetry=0.1))  # fmt: skip
    out, back = friction_at(plant, 0.3), friction_at(plant, -0.3)
    assert out / -back == pytest.approx(1.1 / 0.9, rel=1e-9)
    assert out == pytest.approx(1.1 * 400.0, rel=1e-9)


def test_position_friction_is_higher_at_the_ends(make_plant: MakePlant) -> None:
    """Mid-stroke is neutral, both ends have 1 + k, a quarter of the stroke 1 + k/4."""
    ratios = []
    for position in (0.0, 0.02, 0.04, 0.08):
        plant = make_plant(bare(viscous_friction_coefficient=1000.0, position_friction_rise=0.2,
                                initial_position=position))  # fmt: skip
        ratios.append(friction_at(plant, 0.1) / 100.0)
    assert ratios == pytest.approx([1.2, 1.05, 1.0, 1.2], rel=1e-9)


def test_friction_along_stroke_follows_its_table(make_plant: MakePlant) -> None:
    """Straight between the five points, as numpy interpolates; unstated it rises to one end."""
    places = (0.0, 0.01, 0.035, 0.05, 0.072, 0.08)
    course = {"at_0": 0.5, "at_25": -1.0, "at_50": 0.0, "at_75": 1.0, "at_100": 0.2}
    table = {f"friction_along_stroke_{name}": share for name, share in course.items()}
    for chosen, shares in ((table, [*course.values()]), ({}, [-1.0, -0.5, 0.0, 0.5, 1.0])):
        for place in places:
            plant = make_plant(bare(viscous_friction_coefficient=1000.0, initial_position=place,
                                    friction_along_stroke_strength=0.3, **chosen))  # fmt: skip
            share = np.interp(place / 0.08, [0.0, 0.25, 0.5, 0.75, 1.0], shares)
            assert friction_at(plant, 0.1) == pytest.approx(100.0 * (1 + 0.3 * share), rel=1e-9)


PLUNGER = {"cushion_plunger_length": 10e-3, "cushion_plunger_volume": 1e-6}
AROUND, GAP = math.pi * 9e-3, 5e-5
"""Circumference of the plunger and the gap around it [m]."""


def gap_loss(flow: float, entered: float) -> float:
    """Return the pressure that a gap and its mouth lose: Hagen-Poiseuille and Bernoulli."""
    gain = 0.6 * AROUND * GAP * math.sqrt(2.0 / 850.0)
    laminar = 12.0 * 850.0 * 46e-6 * entered / (AROUND * GAP**3)
    # a gap that is hardly entered counts as laminar up to some 1 bar
    return flow * abs(flow) / gain**2 + flow * math.hypot(laminar, 2.0 * math.sqrt(1e5) / gain)


@pytest.mark.parametrize("extends", [True, False])
def test_cushion_plunger_follows_its_three_balances(extends: bool, make_plant: MakePlant) -> None:
    """Speed and peak pressure of a rod that runs into it are those of Radau, at either end."""
    area = 0.7 * 2.0106e-4 * (0.61 if extends else 1.0)
    plant = make_plant(pond(**PLUNGER) | {"load_mass": 50.0, "initial_position": 0.04})
    plant.state.position = 0.07 if extends else 0.01
    plant.state.velocity = 0.5 if extends else -0.5
    end = "cushion_pressure_b" if extends else "cushion_pressure_a"
    plant.step(0)
    before = float(plant.signals[end])
    pressure, speed = record(plant, 1500, end, "velocity")

    def rates(_: float, state: np.ndarray) -> list[float]:
        left, v, excess = state
        entered = 10e-3 - left
        flow = brentq(lambda q: gap_loss(q, entered) - excess, -1e-2, 1e-2, xtol=1e-16)
        into = area * v - flow - 2e-3 / 60.0 * max(0.0, -excess) / 5e5
        return [-v, -area * excess / 50.0, 1.3e9 / (1e-6 + area * left) * into]

    times = STEP * np.arange(1, 1501)
    exact = solve_ivp(rates, (0.0, times[-1]), [10e-3, 0.5, 0.0], "Radau", times, rtol=1e-8,
                      atol=[1e-12, 1e-10, 1.0])  # fmt: skip
    assert exact.y[2].max() > 100e5
    assert pressure.max() - before == pytest.approx(exact.y[2].max(), rel=1e-3)
    assert np.abs(pressure - before - exact.y[2]).max() < 2e-3 * exact.y[2].max()
    assert np.abs(np.abs(speed) - np.abs(exact.y[1])).max() < 1e-3 * 0.5


def test_cushion_plunger_divides_a_chamber_and_loses_no_oil(make_plant: MakePlant) -> None:
    """What a closed chamber takes up is what the piston displaces: sum of V dp = E alpha A dx."""
    plant = make_plant(bare(**PLUNGER, valve_gain=1e-30, load_mass=500.0))
    plant.state.position, plant.state.velocity = 0.0701, 0.4
    port, end, position = record(plant, 300, "pressure_b", "cushion_pressure_b", "position")
    area = 0.61 * 2.0106e-4
    left = 0.08 - position
    middle = 0.5 * (left[1:] + left[:-1])
    stored = (3e-6 + 0.3 * area * middle) * np.diff(port)
    stored += (1e-6 + 0.7 * area * middle) * np.diff(end)
    assert position.max() > 0.072
    assert np.sum(stored) / 1.3e9 == pytest.approx(area * (position[-1] - position[0]), rel=1e-3)


def test_cushion_plunger_lets_the_rod_go_through_its_check_valve(make_plant: MakePlant) -> None:
    """Leaving the end at a steady speed, the trapped oil is under the port by 5 bar s A v/q_0."""
    shut = {"cushion_plunger_gap": 5e-6, "load_viscous_friction_coefficient": 2e4}
    plant = make_plant(pond(**PLUNGER, **shut) | {"load_mass": 20.0})
    plant.state.position = 0.0795
    plant.inputs.external_force = 1500.0
    settle(plant, 0.05)
    s = plant.signals
    assert 0.0705 < s.position < 0.079
    drawn = 0.7 * 0.61 * 2.0106e-4 * -s.velocity
    assert s.pressure_b - s.cushion_pressure_b == pytest.approx(
        5e5 * drawn / (2e-3 / 60.0), rel=0.01
    )
