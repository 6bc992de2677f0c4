"""The physics of lines, load-holding valves and relief valves between valve and cylinder."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import crossing_frequency, record, settle
from reference_machine import P_S, P_T, STEP, bare, pond
from scipy.integrate import solve_ivp

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
AREA, ALPHA, MODULUS = 2.0106e-4, 0.61, 1.3e9
TEN_LITRES = 10e-3 / 60.0
CLOSED = {"valve_gain": 1e-30}
LONG = {"cylinder_stroke": 2.0, "initial_position": 1.5, "load_viscous_friction_coefficient": 500.0}


def test_pressure_compensator_keeps_the_speed_under_load(make_plant: MakePlant) -> None:
    """Extending, A v = K_v u sqrt(min(p_s - p_a, dp_c)) at every load that leaves the setting."""
    current, kept = 2e-3, 7e5
    plant = make_plant(bare(**LONG | {"initial_position": 0.2}, valve_laminar_width=1e3,
                            pressure_compensator_setting=kept))  # fmt: skip
    plant.state.spool_position = plant.inputs.valve_current = current
    speed = plant.parameters.valve_gain * current * math.sqrt(kept) / AREA
    for force in (0.0, 1000.0, 2000.0):
        plant.inputs.external_force = force
        settle(plant, 3.0)  # the flow damps nothing
        assert P_S - plant.signals.pressure_a > kept
        assert plant.signals.velocity == pytest.approx(speed, rel=2e-3)
    plant.inputs.external_force = 3100.0  # too much: less than the setting is left
    settle(plant, 3.0)
    left = P_S - plant.signals.pressure_a
    assert left < kept
    assert plant.signals.velocity == pytest.approx(speed * math.sqrt(left / kept), rel=1e-2)


def test_cross_port_relief_lets_an_overload_through(make_plant: MakePlant) -> None:
    """Pushed with F, a cylinder with equal areas yields where q_0 (dp - p_set)/dp_o = A v.

    dp = (F - B v)/A, so v is that of two straight lines.
    """
    values = bare(**LONG, **CLOSED, cylinder_area_ratio=1.0, cross_port_relief_setting=180e5)
    plant = make_plant(values)
    for force in (5000.0, -5000.0):
        plant.inputs.external_force = force
        settle(plant, 0.5)
        s = plant.signals
        slope = TEN_LITRES / 20e5
        speed = max(0.0, abs(force) - AREA * 180e5) * slope / (AREA**2 + 500.0 * slope)
        assert -s.velocity == pytest.approx(math.copysign(speed, force), rel=1e-3, abs=1e-6)
        assert s.cross_relief_flow == pytest.approx(-AREA * s.velocity, rel=1e-3, abs=1e-12)
        assert s.leakage_flow == 0.0
    plant.inputs.external_force = 3000.0
    settle(plant, 2.0)
    assert plant.signals.cross_relief_flow == 0.0
    assert plant.signals.velocity == pytest.approx(0.0, abs=1e-4)


def _yielding(make_plant: MakePlant, tank: float) -> tuple[Plant, float]:
    """Push a cylinder in whose ports are closed; return it and the speed of its straight lines."""
    relief = {"port_relief_valves_setting": 180e5, "anti_cavitation_flow": TEN_LITRES / 2.0}
    plant = make_plant(bare(**LONG, **CLOSED, **relief, tank_pressure=tank))
    plant.inputs.external_force = 5000.0
    settle(plant, 1.0)
    # F - B v = A p_a - alpha A p_b,  A v = q_0 (p_a - p_t - p_set)/dp_o,
    # alpha A v = q_1 (p_t - dp_c - p_b)/dp_1
    rigid = AREA * (tank + 180e5) - ALPHA * AREA * (tank - 0.2e5)
    soft = AREA**2 * 20e5 / TEN_LITRES + (ALPHA * AREA) ** 2 * 5e5 / (TEN_LITRES / 2.0)
    return plant, (5000.0 - rigid) / (soft + 500.0)


def test_port_relief_valves_bound_the_pressure_of_a_chamber(make_plant: MakePlant) -> None:
    """The chamber that is pushed in gives its oil to the return line at the valve's pressure."""
    plant, speed = _yielding(make_plant, 10e5)
    s = plant.signals
    assert -s.velocity == pytest.approx(speed, rel=1e-3)
    assert s.pressure_a == pytest.approx(190e5 + 20e5 * AREA * speed / TEN_LITRES, rel=1e-4)
    # what one chamber gives and the other does not take
    assert s.tank_flow == pytest.approx((1.0 - ALPHA) * AREA * speed, rel=1e-3)
    # the work of the push without friction becomes heat, except for the oil at tank pressure
    work = 5000.0 * speed - 500.0 * speed**2
    assert s.relief_loss + 10e5 * s.tank_flow == pytest.approx(work, rel=1e-3)


def test_anti_cavitation_fills_a_chamber_from_the_return_line(make_plant: MakePlant) -> None:
    """The chamber that grows stays as far under the return line as its flow asks for."""
    plant, speed = _yielding(make_plant, 10e5)
    expected = 10e5 - 0.2e5 - 5e5 * ALPHA * AREA * speed / (TEN_LITRES / 2.0)
    assert plant.signals.pressure_b == pytest.approx(expected, rel=1e-3)
    without = make_plant(bare(**LONG, **CLOSED, tank_pressure=10e5, port_relief_valves_setting=1e5))
    without.inputs.external_force = 5000.0
    settle(without, 0.2)
    assert without.signals.pressure_b == 0.0


def test_shut_off_valves_lose_pressure_by_two_laws_while_open(make_plant: MakePlant) -> None:
    """At steady speed dp = q²/K² + 2 √w q/K: the positive root of a quadratic."""
    plant = make_plant(bare(**LONG, shut_off_valves_closing_time=0.05))
    plant.state.position = 0.3
    plant.inputs.valve_current = 8e-3
    settle(plant, 0.5)
    s = plant.signals
    for drop, flow in (
        (s.block_pressure_a - s.pressure_a, AREA * s.velocity),
        (s.pressure_b - s.block_pressure_b, ALPHA * AREA * s.velocity),
    ):
        expected = max(np.roots([1.5e-7**-2, 2.0 * math.sqrt(2e5) / 1.5e-7, -drop]))
        assert flow == pytest.approx(expected, rel=1e-4)
    assert s.line_loss == pytest.approx(
        AREA * s.velocity * (s.block_pressure_a - s.pressure_a)
        + ALPHA * AREA * s.velocity * (s.pressure_b - s.block_pressure_b), rel=1e-4,
    )  # fmt: skip


def test_shut_off_valves_close_in_their_time(make_plant: MakePlant) -> None:
    """After half of 50 ms they pass half; then nothing until they are opened again."""
    plant = make_plant(pond(shut_off_valves_closing_time=0.05))
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.1)
    plant.parameters.lines_closed = 1.0
    settle(plant, 0.025)
    s = plant.signals
    drop = float(s.block_pressure_a - s.pressure_a)
    full = max(np.roots([1.5e-7**-2, 2.0 * math.sqrt(2e5) / 1.5e-7, -drop]))
    assert s.flow_a / full == pytest.approx(0.5, abs=1e-3)
    settle(plant, 0.1)
    assert [s.flow_a, s.flow_b] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert s.block_pressure_a == pytest.approx(P_S, rel=1e-6)
    plant.parameters.lines_closed = 0.0
    settle(plant, 0.1)
    assert s.flow_a > 1e-7


def test_shut_off_valves_leave_two_springs_of_oil(make_plant: MakePlant) -> None:
    """Closed, the rod yields by dx = F/(A² E (1/V_a + alpha²/V_b)) whatever the valve does."""
    plant = make_plant(bare(shut_off_valves_closing_time=0.02, lines_closed=1.0, load_mass=5.0,
                            load_viscous_friction_coefficient=5e3))  # fmt: skip
    settle(plant, 0.2)
    before = float(plant.signals.position)
    plant.inputs.valve_current = 1e-2
    plant.inputs.external_force = 300.0
    settle(plant, 0.3)
    volume_a = 3e-6 + AREA * before
    volume_b = 3e-6 + ALPHA * AREA * (0.08 - before)
    stiffness = AREA**2 * MODULUS * (1.0 / volume_a + ALPHA**2 / volume_b)
    assert before - plant.signals.position == pytest.approx(300.0 / stiffness, rel=5e-3)


@pytest.mark.parametrize(("supply", "lowers"), [(29e5, False), (33e5, True)])
def test_pilot_check_valves_hold_a_load_until_piloted(
    make_plant: MakePlant, supply: float, lowers: bool
) -> None:
    """2000 N rest on chamber a; the valve gives a to tank and b to supply.

    p_a = F/A + alpha p_s, and the poppet opens at p_t + 4 (p_s - p_t) = p_a + 2 bar: 30.8 bar.
    """
    at_limit = (2000.0 / AREA + 2e5 + 3.0 * P_T) / (4.0 - ALPHA)
    assert at_limit == pytest.approx(30.8e5, rel=1e-3)
    held = {"pilot_check_valves_ratio": 4.0, "pilot_check_valves_chamber": 1.0}
    plant = make_plant(bare(**held, supply_pressure=supply, load_viscous_friction_coefficient=5e3))
    plant.inputs.external_force = 2000.0
    plant.inputs.valve_current = -1e-3
    settle(plant, 1.0)
    before = float(plant.signals.position)
    assert plant.signals.pressure_a > 80e5 or lowers
    settle(plant, 1.0)
    sunk = before - float(plant.signals.position)
    assert sunk > 1e-4 if lowers else abs(sunk) < 1e-6


def test_pilot_check_valves_let_oil_in_without_a_pilot(make_plant: MakePlant) -> None:
    """Towards the chamber they are check valves: the rod extends as ever, against their loss."""
    speeds = []
    for ratio in (0.0, 4.0):
        plant = make_plant(bare(**LONG, pilot_check_valves_ratio=ratio,
                                pilot_check_valves_chamber=1.0))  # fmt: skip
        plant.state.position = 0.3
        plant.inputs.valve_current = 2e-3
        settle(plant, 0.5)
        speeds.append(float(plant.signals.velocity))
    assert 0.9 * speeds[0] < speeds[1] < speeds[0]


def test_cylinder_lines_ring_at_their_quarter_wave(make_plant: MakePlant) -> None:
    """Between a valve that shuts and a large chamber a line of 1 m rings at c/(4 l) = 309 Hz."""
    plant = make_plant(pond(cylinder_lines_length=1.0))
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.2)
    plant.inputs.valve_current = 0.0
    settle(plant, 0.01)
    pressures = record(plant, 3000, "port_pressure_a", "port_pressure_b")
    for pressure in pressures:
        assert crossing_frequency(pressure, STEP) == pytest.approx(1237.0 / 4.0, rel=5e-3)


def test_cylinder_lines_surge_when_the_flow_stops(make_plant: MakePlant) -> None:
    """A single mode of impedance √(L/C) surges by pi/2 rho c v, where Joukowsky has rho c v."""
    plant = make_plant(pond(cylinder_lines_length=1.0, valve_natural_frequency=1000.0,
                            oil_kinematic_viscosity=1e-6))  # fmt: skip
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.5)
    flow, before = float(plant.signals.flow_a), float(plant.signals.port_pressure_a)
    plant.state.spool_position = plant.inputs.valve_current = 0.0
    (pressure,) = record(plant, 200, "port_pressure_a")
    joukowsky = 850.0 * 1237.0 * flow / (math.pi / 4.0 * 6e-3**2)
    assert before - pressure.min() == pytest.approx(0.5 * math.pi * joukowsky, rel=0.02)


@pytest.mark.parametrize(("current", "diameter"), [(1e-3, 6e-3), (1e-2, 4e-3)])
def test_cylinder_lines_lose_pressure_as_pipes_do(
    make_plant: MakePlant, current: float, diameter: float
) -> None:
    """Hagen-Poiseuille 128 mu l q/(pi d^4); or Blasius, 0.241 rho^¾ mu^¼ l q^1.75/d^4.75."""
    plant = make_plant(pond(cylinder_lines_length=1.0, cylinder_lines_diameter=diameter))
    plant.inputs.valve_current = current
    settle(plant, 0.3)
    s = plant.signals
    mu, q = 850.0 * 46e-6, float(s.flow_a)
    laminar = 128.0 * mu * q / (math.pi * diameter**4)
    turbulent = 0.241 * 850.0**0.75 * mu**0.25 * q**1.75 / diameter**4.75
    assert (turbulent > laminar) == (current == 1e-2)
    assert s.port_pressure_a - s.pressure_a == pytest.approx(max(laminar, turbulent), rel=5e-3)


def test_cylinder_lines_lose_zeta_times_the_dynamic_pressure(make_plant: MakePlant) -> None:
    """Bends of zeta = 12 lose 12 rho v²/2 more than the wall does (S2 eq. 3-4)."""
    drops, flows = [], []
    for zeta in (0.0, 12.0):
        plant = make_plant(pond(cylinder_lines_length=0.5, cylinder_lines_form_losses=zeta))
        plant.inputs.valve_current = 5e-3
        settle(plant, 0.3)
        drops.append(plant.signals.port_pressure_a - plant.signals.pressure_a)
        flows.append(float(plant.signals.flow_a))
    assert flows[0] == pytest.approx(flows[1], rel=1e-2)
    speed = flows[1] / (math.pi * 6e-3**2 / 4)
    wall = drops[0] * (flows[1] / flows[0])
    assert drops[1] - wall == pytest.approx(12 * 850.0 * speed**2 / 2, rel=5e-3)


def test_cylinder_lines_obey_their_two_balances(make_plant: MakePlant) -> None:
    """A valve that opens onto a line and a large chamber, as Radau solves both balances."""
    plant = make_plant(pond(cylinder_lines_length=2.0))
    plant.state.spool_position = plant.inputs.valve_current = 2e-3
    (port,) = record(plant, 1000, "port_pressure_a")
    area = math.pi / 4.0 * 6e-3**2
    inertance = 850.0 * 2.0 / area
    capacity = (2.0 * 2.0 / (math.pi * 1237.0)) ** 2 / inertance
    resistance = 128.0 * 850.0 * 46e-6 * 2.0 / (math.pi * 6e-3**4)
    chamber = ALPHA * P_S / (1.0 + ALPHA)

    def rates(_: float, state: np.ndarray) -> list[float]:
        flow, pressure = state
        drop = P_S - pressure
        drawn = 6.68e-6 * 2e-3 * drop / (drop * drop + 1e10) ** 0.25
        lost = resistance * flow
        return [(pressure - chamber - lost) / inertance, (drawn - flow) / capacity]

    times = STEP * np.arange(1, 1001)
    exact = solve_ivp(rates, (0.0, times[-1]), [0.0, chamber], "Radau", times, rtol=1e-9, atol=1e-9)
    assert np.abs(port - exact.y[1]).max() < 1e-4 * P_S
