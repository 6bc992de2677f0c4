"""The physics of the load and of its coupling to the rod."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import crossing_frequency, record, settle
from reference_machine import STEP, ballistic, bare
from scipy.integrate import solve_ivp

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]


def test_load_viscous_friction_sets_the_terminal_speed(make_plant: MakePlant) -> None:
    """A constant force F ends at F/B_l, and the load cell of a free rod reads nothing."""
    plant = make_plant(ballistic(load_viscous_friction_coefficient=500.0))
    plant.inputs.external_force = -10.0
    settle(plant, 1.0)
    assert plant.signals.velocity == pytest.approx(0.02, rel=1e-3)
    assert plant.signals.load_force == pytest.approx(0.0, abs=0.01)


def test_gravity_is_carried_by_the_load_cell_at_rest(make_plant: MakePlant) -> None:
    """Held by shut chambers, the cell reads the weight."""
    plant = make_plant(bare(gravity_force=200.0, viscous_friction_coefficient=5000.0))
    settle(plant, 1.0)
    assert plant.signals.load_force == pytest.approx(200.0, rel=1e-3)


@pytest.mark.parametrize(
    ("load", "force"),
    [
        ({"gravity_force": 1500.0}, 1500.0),
        ({"gravity_force": -1000.0, "coupling_compliance_compliance": 1e-7,
          "backlash_gap": 1e-4}, -1000.0),
        ({"load_spring_stiffness": 5e4, "load_spring_rest_position": 0.03}, 500.0),
        # 160 bar on the piston hold 3200 N: this one falls, and swings on its oil
        ({"gravity_force": 5000.0}, None),
    ],
)  # fmt: skip
def test_a_plant_starts_in_balance_with_its_load(
    load: dict[str, float], force: float | None, make_plant: MakePlant
) -> None:
    """Nothing moves from the start on, but a load that no pressure of the supply holds."""
    plant = make_plant(bare(**load, rod_mass_mass=0.3))
    readings, velocity = record(plant, 1000, "load_force", "velocity")
    if force is None:
        assert velocity.min() < -1e-3
        return
    assert np.abs(velocity).max() < 1e-6
    assert readings == pytest.approx(np.full(1000, force), rel=1e-4)


def test_load_spring_rings_with_the_mass(make_plant: MakePlant) -> None:
    """Around its rest position a mass on a spring swings at sqrt(k/M)."""
    plant = make_plant(ballistic(load_spring_stiffness=2e4, load_spring_rest_position=0.04))
    plant.state.velocity = 0.1
    (position,) = record(plant, 25_000, "position")
    frequency = crossing_frequency(position - 0.04, STEP)
    assert frequency == pytest.approx(math.sqrt(2e4 / 50.0) / (2 * math.pi), rel=0.01)


def test_wall_resists_on_one_side_alone(make_plant: MakePlant) -> None:
    """Before the wall nothing acts; leaning on it the load rests F/k deep."""
    plant = make_plant(ballistic(wall_stiffness=1e6, wall_distance=0.05,
                                 viscous_friction_coefficient=2000.0))  # fmt: skip
    assert plant.signals.resisting_force == 0.0
    plant.inputs.external_force = -300.0
    settle(plant, 1.0)
    assert plant.signals.position - 0.05 == pytest.approx(300.0 / 1e6, rel=1e-3)


def test_wall_that_comes_pushes_the_load_against_its_spring(make_plant: MakePlant) -> None:
    """Two springs in series: advanced by s, the wall pushes with s k k_s/(k + k_s)."""
    plant = make_plant(ballistic(wall_stiffness=1e5, wall_distance=0.04, load_spring_stiffness=5e4,
                                 load_spring_rest_position=0.04,
                                 load_viscous_friction_coefficient=1000.0))  # fmt: skip
    plant.inputs.wall_shift = -0.01
    settle(plant, 2.0)
    force = 0.01 * 1e5 * 5e4 / 1.5e5
    assert plant.signals.position == pytest.approx(0.04 - force / 5e4, abs=1e-7)
    plant.inputs.wall_shift = 0.0
    settle(plant, 3.0)
    assert plant.signals.position == pytest.approx(0.04, abs=1e-7)


def test_wall_that_strikes_follows_an_exact_solution(make_plant: MakePlant) -> None:
    """A free mass hit by a wall that moves, and let go by it, as scipy integrates it."""
    plant = make_plant(ballistic(wall_stiffness=1e6, wall_distance=0.041, wall_damping=2.0,
                                 wall_time_constant=0.02))  # fmt: skip

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v, s = y
        speed = (-0.005 - s) / 0.02
        depth = max(0.0, x - 0.041 - s)
        push = max(0.0, 1e6 * depth * (1 + 2.0 * (v - speed)))
        return [v, -push / 50.0, speed]

    exact = solve_ivp(rates, (0.0, 0.1), [0.04, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:2, -1]
    plant.inputs.wall_shift = -0.005
    settle(plant, 0.1)
    assert exact[1] < -0.1
    assert plant.signals.velocity == pytest.approx(exact[1], rel=1e-4)
    assert plant.signals.position == pytest.approx(exact[0], abs=1e-6)


def test_harmonic_force_has_its_amplitude_and_frequency(make_plant: MakePlant) -> None:
    """A free mass answers a force F sin(wt) with an amplitude F/(M w²)."""
    plant = make_plant(ballistic(harmonic_force_amplitude=200.0, harmonic_force_frequency=5.0))
    w = 2 * math.pi * 5.0
    plant.state.velocity = 200.0 / (50.0 * w)
    force, position = record(plant, 30_000, "resisting_force", "position")
    assert force.max() == pytest.approx(200.0, rel=1e-4)
    assert crossing_frequency(force, STEP) == pytest.approx(5.0, rel=1e-3)
    assert np.ptp(position) / 2 == pytest.approx(200.0 / (50.0 * w**2), rel=1e-3)


def test_rotary_joint_reflects_the_published_mass(make_plant: MakePlant) -> None:
    """0.0218 kg m² at a right angle of crank and rod (lever 45 mm) weigh 10.8 kg at the rod."""
    retracted = math.sqrt(0.322**2 - 0.045**2) - 0.04
    values = ballistic(rotary_joint_inertia=0.0218, rotary_joint_retracted_length=retracted,
                       load_mass=0.1)  # fmt: skip
    plant = make_plant(values)
    plant.inputs.external_force = -10.0
    plant.step(0)
    assert 10.0 / plant.signals.acceleration - 0.1 == pytest.approx(10.8, rel=5e-3)


def test_rotary_joint_keeps_its_energy_along_the_stroke(make_plant: MakePlant) -> None:
    """The lever changes, so a free joint speeds the rod up or down at constant energy."""
    a, b, c_0, inertia = 0.322, 0.045, 0.282, 0.0218
    plant = make_plant(ballistic(rotary_joint_inertia=inertia, load_mass=0.1,
                                 initial_position=0.01))  # fmt: skip
    plant.state.velocity = 0.5
    position, velocity = record(plant, 6000, "position", "velocity")
    c = c_0 + position
    theta = np.arccos((a**2 + b**2 - c**2) / (2 * a * b))
    lever = a * b * np.sin(theta) / c
    energy = 0.5 * (0.1 + inertia / lever**2) * velocity**2
    assert np.ptp(position) > 0.04
    assert np.ptp(velocity) > 0.1
    assert np.ptp(energy) / energy[0] < 1e-3


def test_rotary_joint_turns_a_torque_into_a_force(make_plant: MakePlant) -> None:
    """Force at the rod is torque over lever arm."""
    plant = make_plant(ballistic(rotary_joint_inertia=0.0218, rotary_joint_torque=9.0,
                                 rotary_joint_retracted_length=math.sqrt(0.322**2 - 0.045**2)
                                 - 0.04))  # fmt: skip
    assert plant.signals.resisting_force == pytest.approx(9.0 / 0.045, rel=1e-6)


def test_coupling_compliance_stretches_under_load_and_rings(make_plant: MakePlant) -> None:
    """At rest rod and load differ by C f; struck, they ring at sqrt((1/m_p + 1/M)/C)."""
    plant = make_plant(ballistic(coupling_compliance_compliance=1e-7, rod_mass_mass=0.5,
                                 load_mass=2.0, load_coupling_damping=0.0))  # fmt: skip
    plant.state.velocity = plant.state.stretch_speed = 0.01  # the load rests
    (force,) = record(plant, 4000, "load_force")
    expected = math.sqrt((1 / 0.5 + 1 / 2.0) / 1e-7) / (2 * math.pi)
    assert crossing_frequency(force, STEP) == pytest.approx(expected, rel=5e-3)
    held = make_plant(bare(coupling_compliance_compliance=1e-7, gravity_force=500.0,
                           viscous_friction_coefficient=1e4))  # fmt: skip
    settle(held, 1.0)
    stretch = held.signals.position - held.signals.load_position
    assert held.signals.load_force == pytest.approx(500.0, rel=1e-3)
    assert stretch == pytest.approx(500.0 * 1e-7, rel=1e-3)


def test_backlash_carries_no_force_within_its_gap(make_plant: MakePlant) -> None:
    """At a reversal the rod moves the gap before the load follows, and the cell reads zero."""
    plant = make_plant(
        bare(
            backlash_gap=2e-4,
            backlash_softness=1e-4, viscous_friction_coefficient=1000.0, rod_mass_mass=0.5,
            load_viscous_friction_coefficient=2000.0, load_mass=5.0,
        )
    )  # fmt: skip
    names = ("position", "load_position", "load_force")
    plant.inputs.valve_current = 3e-4
    x, x_l, f = record(plant, 8000, *names)
    assert x[-1] - x_l[-1] == pytest.approx(1e-4, rel=0.05)
    plant.inputs.valve_current = -3e-4
    x, x_l, f = record(plant, 8000, *names)
    assert x[-1] - x_l[-1] == pytest.approx(-1e-4, rel=0.05)
    inside = np.abs(x - x_l) < 1e-4
    assert np.count_nonzero(inside) > 20
    assert np.all(f[inside] == 0.0)


def test_load_coulomb_friction_stops_a_mass_in_finite_time(make_plant: MakePlant) -> None:
    """With v = v_0 - F t/M 50 kg at 0.1 m/s rest after 50 ms; a free rod's load cell reads 0."""
    plant = make_plant(ballistic(load_coulomb_friction_force=100.0))
    plant.state.velocity = 0.1
    velocity, force = record(plant, 4000, "velocity", "load_force")
    time = STEP * np.arange(1, 4001)
    sliding = time < 0.048
    assert velocity[sliding] == pytest.approx(0.1 - 2.0 * time[sliding], abs=2e-4)
    assert np.abs(velocity[time > 0.06]).max() < 3e-3  # what the bristles' springs give back
    assert plant.state.position == pytest.approx(0.04 + 0.1**2 / (2 * 2.0), abs=6e-5)
    assert np.abs(force).max() < 0.1


def test_load_coulomb_friction_is_in_front_of_the_load_cell(make_plant: MakePlant) -> None:
    """Pushed at steady speed, the cell reads it; friction of the seals it does not."""
    plant = make_plant(bare(load_coulomb_friction_force=150.0, coulomb_friction_force=80.0))
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.3)
    assert plant.signals.velocity > 0.05
    assert plant.signals.load_force == pytest.approx(150.0, rel=0.02)
    assert plant.signals.hydraulic_force == pytest.approx(230.0, rel=0.02)


@pytest.mark.parametrize(("force", "moves"), [(95.0, False), (110.0, True)])
def test_load_coulomb_friction_holds_what_is_below_it(
    force: float, moves: bool, make_plant: MakePlant
) -> None:
    """A load pushed with less than F_c stays, without creep; with more it slides at (F - F_c)/M."""
    plant = make_plant(ballistic(load_coulomb_friction_force=100.0))
    plant.inputs.external_force = -force
    settle(plant, 0.5)
    start = float(plant.state.position)
    settle(plant, 0.5)
    way = float(plant.state.position) - start
    if moves:
        assert plant.signals.acceleration == pytest.approx((force - 100.0) / 50.0, rel=0.05)
    else:
        assert abs(way) < 1e-8


def test_load_coulomb_friction_acts_on_an_elastic_load(make_plant: MakePlant) -> None:
    """Behind a coupling that gives way the load sticks while the rod moves: F = k s below F_c."""
    values = {"load_coulomb_friction_force": 400.0, "coupling_compliance_compliance": 1e-5,
              "rod_mass_mass": 0.3, "viscous_friction_coefficient": 3000.0}  # fmt: skip
    plant = make_plant(bare(**values))
    plant.inputs.valve_current = 2e-4
    settle(plant, 0.05)
    stretch = plant.signals.position - plant.signals.load_position
    assert plant.signals.load_force < 390.0
    assert stretch > 1e-4
    assert plant.signals.load_position == pytest.approx(0.04, abs=5e-5)


def test_load_stribeck_friction_fades_with_speed(make_plant: MakePlant) -> None:
    """F = F_s exp(-|v|/v_s): what holds a load at a speed, by an independent sum of forces."""
    for speed in (0.005, 0.02, 0.06):
        values = {"load_stribeck_friction_excess": 80.0, "load_coulomb_friction_force": 100.0}
        plant = make_plant(ballistic(**values, load_mass=1e5))
        plant.state.velocity = speed
        plant.state.load_coulomb_friction_bend = plant.state.load_stribeck_friction_bend = 3.0
        settle(plant, 1e-4)
        expected = 100.0 + 80.0 * math.exp(-speed / 0.02)
        assert plant.signals.resisting_force == pytest.approx(expected, rel=0.01)
