"""The physics of pumps, relief valve, accumulator and lines; power and efficiency."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import crossing_frequency, record, settle
from reference_machine import P_S, STEP, bare, pond

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
TEN_LITRES = 10e-3 / 60.0
LEAKING = {"fixed_pump_flow": TEN_LITRES, "pump_leakage_flow": 1e-3 / 60.0}


def test_fixed_pump_relieves_the_unused_flow(make_plant: MakePlant) -> None:
    """At rest the whole flow passes the relief valve at set pressure: all its power is lost."""
    plant = make_plant(bare(fixed_pump_flow=TEN_LITRES))
    settle(plant, 0.2)
    s = plant.signals
    assert s.pump_pressure == pytest.approx(P_S, rel=1e-6)
    assert s.relief_flow == pytest.approx(TEN_LITRES, rel=1e-6)
    assert s.pump_power == pytest.approx(P_S * TEN_LITRES, rel=1e-6)
    assert s.efficiency == 0.0


def test_fixed_pump_loses_pressure_with_flow_and_collapses_beyond_its_own(
    make_plant: MakePlant,
) -> None:
    """Drawn flow lowers pressure by its share of the override; the pump gives no more than q_0."""
    plant = make_plant(pond(fixed_pump_flow=TEN_LITRES, fixed_pump_override=10e5))
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.3)
    s = plant.signals
    assert 0 < s.supply_flow < TEN_LITRES
    expected = P_S - 10e5 * s.supply_flow / TEN_LITRES
    assert s.supply_pressure == pytest.approx(expected, rel=1e-4)
    plant.inputs.valve_current = 2e-2
    settle(plant, 0.3)
    assert s.supply_flow == pytest.approx(TEN_LITRES, rel=0.01)
    assert s.relief_flow == 0.0
    assert s.supply_pressure < 100e5


def test_variable_pump_delivers_what_is_drawn_and_droops(make_plant: MakePlant) -> None:
    """At rest no flow and no power; drawing lowers pressure by the flow's share of the droop."""
    plant = make_plant(pond(variable_pump_flow=TEN_LITRES, variable_pump_droop=10e5))
    settle(plant, 0.3)
    s = plant.signals
    assert s.pump_power == pytest.approx(0.0, abs=1.0)
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.6)
    assert s.pump_flow == pytest.approx(s.supply_flow, rel=1e-3)
    expected = P_S - 10e5 * s.supply_flow / TEN_LITRES
    assert s.supply_pressure == pytest.approx(expected, rel=1e-4)


def test_variable_pump_droops_less_the_larger_it_is(make_plant: MakePlant) -> None:
    """At the same flow a pump of twice the size loses half the pressure: it fades to ideal."""
    lost = []
    for flow in (TEN_LITRES, 2 * TEN_LITRES, 4 * TEN_LITRES):
        plant = make_plant(pond(variable_pump_flow=flow))
        plant.inputs.valve_current = 5e-4
        settle(plant, 1.5)
        lost.append((P_S - float(plant.signals.supply_pressure)) / plant.signals.supply_flow)
    assert [lost[0] / lost[1], lost[1] / lost[2]] == pytest.approx([2.0, 2.0], rel=1e-3)


def test_variable_pump_relieves_what_a_load_pushes_back(make_plant: MakePlant) -> None:
    """Oil that an overrunning rod pushes back cannot turn the pump: the relief valve takes it.

    At steady speed v the piston displaces A v, so the relief valve's line gives the pressure,
    p = p_set + 20 bar + 10 bar A v/q_max, and the load pays the heat: p A v.
    """
    sizes = {"cylinder_stroke": 3.0, "initial_position": 2.9, "tank_pressure": 40e5}
    plant = make_plant(bare(**sizes, variable_pump_flow=TEN_LITRES, pump_leakage_flow=1e-3 / 60,
                            load_viscous_friction_coefficient=2000.0))  # fmt: skip
    plant.inputs.valve_current = 5e-3
    plant.inputs.external_force = 6000.0
    settle(plant, 1.5)
    s = plant.signals
    pushed = 2.0106e-4 * -float(s.velocity)
    assert 0.2 < pushed / TEN_LITRES < 1.0
    assert s.pump_flow == pytest.approx(0.0, abs=1e-12)
    assert s.pump_leakage_flow == pytest.approx(0.0, abs=1e-12)
    assert s.relief_flow == pytest.approx(pushed, rel=1e-3)
    assert s.supply_pressure == pytest.approx(P_S + 20e5 + 10e5 * pushed / TEN_LITRES, rel=1e-4)
    assert -s.supply_power == pytest.approx(s.pump_pressure * s.relief_flow, rel=1e-3)
    # the rod side draws from the tank less than the cap side returns to the reservoir
    assert s.return_flow == pytest.approx(pushed * (1.0 - 0.61), rel=2e-3)


def test_variable_pump_lets_no_oil_back_through_its_own_leakage(make_plant: MakePlant) -> None:
    """Its check valve holds an accumulator's pressure while the pump stands still."""
    plant = make_plant(bare(variable_pump_flow=TEN_LITRES, pump_leakage_flow=1e-3 / 60,
                            accumulator_gas_volume=4e-5))  # fmt: skip
    plant.state.pump_pressure = 15e5
    settle(plant, 1.0)
    assert plant.signals.pump_flow == 0.0
    assert plant.signals.pump_pressure == pytest.approx(P_S + 15e5, rel=1e-12)


@pytest.mark.parametrize(("pressure", "efficiency"), [(100e5, 0.99), (250e5, 0.90)])
def test_pump_leakage_has_the_published_efficiencies(
    make_plant: MakePlant, pressure: float, efficiency: float
) -> None:
    """A 10 l/min pump delivers 99 % at 100 bar and 90 % at 250 bar (S1 3.2)."""
    plant = make_plant(bare(**LEAKING, supply_pressure=pressure))
    s = plant.signals
    assert s.pump_pressure == pressure
    assert 1.0 - s.pump_leakage_flow / s.pump_flow == pytest.approx(efficiency, abs=1e-5)


def test_pump_leakage_stays_below_one_percent_up_to_100_bar(make_plant: MakePlant) -> None:
    """The 99 % of S1 3.2 hold at every pressure below 100 bar, not there alone."""
    for pressure in (1e5, 25e5, 50e5, 75e5, 99e5):
        plant = make_plant(bare(**LEAKING, supply_pressure=pressure))
        assert 0.0 < plant.signals.pump_leakage_flow / plant.signals.pump_flow < 0.01


def test_pump_leakage_is_laminar(make_plant: MakePlant) -> None:
    """Gaps that keep their width leak in proportion to dp/mu, Wilson's slip.

    At 100 °C the oil has 6.8 mm²/s instead of 46 (ISO 3448, viscosity index 100).
    """

    def leakage(**changes: float) -> float:
        stiff = {"pump_leakage_widening_pressure": 1e10, "viscosity_temperature_slope": 3.68}
        return float(make_plant(bare(**LEAKING, **stiff, **changes)).signals.pump_leakage_flow)

    cold = leakage(supply_pressure=200e5)
    assert cold / leakage(supply_pressure=50e5) == pytest.approx(4.0, rel=0.01)
    hot = leakage(supply_pressure=200e5, oil_temperature=373.15)
    assert hot / cold == pytest.approx(46.0 / 6.8, rel=0.01)


def test_pump_friction_and_leakage_have_both_published_efficiencies(make_plant: MakePlant) -> None:
    """Of the shaft's power 90 % leave the pump at 160 bar (S1 Table 3.1), of its flow 97 %."""
    plant = make_plant(bare(**LEAKING, pump_friction_coefficient=0.045))
    s = plant.signals
    useful = s.pump_pressure * (s.pump_flow - s.pump_leakage_flow)
    assert useful / s.shaft_power == pytest.approx(0.90, abs=1e-4)
    assert useful / s.pump_power == pytest.approx(0.97, abs=1e-3)


def test_pump_friction_is_wilsons_torque(make_plant: MakePlant) -> None:
    """T = D p + C_f D p + C_d mu omega D by hand, at any stroke: D = 6.67 cm³ per turn.

    10 l/min at 1500 rpm; at 100 °C the oil has 6.8 mm²/s instead of 46 (ISO 3448).
    """
    volume_per_radian = 10e-3 / 1500.0 / (2.0 * np.pi)
    for temperature, thinner in ((313.15, 1.0), (373.15, 6.8 / 46.0)):
        values = bare(
            pump_friction_coefficient=0.05, pump_friction_drag=4e5,
            viscosity_temperature_slope=3.68, oil_temperature=temperature,
        )  # fmt: skip
        friction = volume_per_radian * (0.05 * P_S + 4e5 * thinner)
        fixed = make_plant(values | {"fixed_pump_flow": TEN_LITRES}).signals
        ideal = volume_per_radian * P_S
        assert fixed.shaft_torque == pytest.approx(ideal + friction, rel=1e-3)
        # no flow, and so no stroke, is asked of a compensated pump at its set pressure
        idle = make_plant(values | {"variable_pump_flow": TEN_LITRES}).signals
        assert idle.shaft_torque == pytest.approx(friction, rel=0.01 if thinner < 1.0 else 1e-4)


def test_accumulator_keeps_p_v_to_the_n(make_plant: MakePlant) -> None:
    """What leaves the node expands the gas polytropically, as long as p exceeds the pre-charge."""
    gas = {"accumulator_gas_volume": 4e-5, "accumulator_precharge": 100e5}
    plant = make_plant(pond(variable_pump_flow=1e-6, **gas))
    plant.inputs.valve_current = 1e-3
    drawn, given, pressure = record(plant, 5000, "supply_flow", "pump_flow", "supply_pressure")
    oil = 1e-3 / 1.3e9

    def contents(p: np.ndarray) -> np.ndarray:
        return 4e-5 * (1 - (100e5 / p) ** (1 / 1.4)) + oil * p

    assert pressure[-1] > 100e5
    left = float(np.trapezoid(drawn - given, dx=STEP))
    assert left > 2e-6
    assert contents(pressure[0]) - contents(pressure[-1]) == pytest.approx(left, rel=1e-3)


def test_supply_line_rings_at_its_quarter_wave(make_plant: MakePlant) -> None:
    """A 2 m line rings at c/(4 l) = 155 Hz after the valve shuts."""
    plant = make_plant(pond(supply_line_length=2.0))
    plant.inputs.valve_current = 1e-3
    settle(plant, 0.2)
    steady = float(plant.signals.supply_pressure)
    plant.inputs.valve_current = 0.0
    settle(plant, 0.01)
    (pressure,) = record(plant, 4000, "supply_pressure")
    assert crossing_frequency(pressure, STEP) == pytest.approx(1237.0 / 8.0, rel=5e-3)
    # Joukowsky: a stopped flow raises pressure by about rho c dv, less as the spool is slow
    area = np.pi / 4 * 8e-3**2
    surge = 850 * 1237 * 6.68e-6 * 1e-3 * np.sqrt(P_S - 60.6e5) / area
    assert 0.2 * surge < np.abs(pressure - steady).max() < 1.5 * surge


def test_supply_line_loses_zeta_times_the_dynamic_pressure(make_plant: MakePlant) -> None:
    """At a steady flow: Hagen-Poiseuille of the wall and 30 rho v²/2 of bends and fittings."""
    plant = make_plant(pond(supply_line_length=2.0, supply_line_form_losses=30.0))
    plant.inputs.valve_current = 1e-2
    settle(plant, 0.5)
    s = plant.signals
    flow = float(s.flow_a)
    area = math.pi * 8e-3**2 / 4
    wall = 128.0 * 850.0 * 46e-6 * 2.0 * flow / (math.pi * 8e-3**4)
    bends = 30.0 * 850.0 * (flow / area) ** 2 / 2
    assert bends > 2e4
    assert 160e5 - s.supply_pressure == pytest.approx(wall + bends, rel=0.01)


def test_pilot_leakage_draws_the_published_flow_at_rest(make_plant: MakePlant) -> None:
    """0.28 l/min at 210 bar with the spool centred, all of it heat."""
    plant = make_plant(bare(pilot_leakage_conductance=2.2e-13, supply_pressure=210e5))
    settle(plant, 0.01)
    s = plant.signals
    assert s.supply_flow * 60e3 == pytest.approx(0.28, rel=0.02)
    assert s.tank_flow == s.supply_flow
    assert s.valve_loss == pytest.approx(s.supply_power - s.tank_pressure * s.tank_flow, rel=1e-9)


def test_back_pressure_grows_with_the_square_of_the_flow(make_plant: MakePlant) -> None:
    """p_t - p_t0 = R q²: 5 bar at 7.5 l/min."""
    assert pytest.approx(5e5) == 3.2e13 * (7.5e-3 / 60) ** 2
    rises = []
    for current in (2e-3, 4e-3):
        plant = make_plant(pond(back_pressure_resistance=3.2e13))
        plant.inputs.valve_current = current
        settle(plant, 0.05)
        rise = float(plant.signals.tank_pressure) - 1e5
        rises.append(rise)
        assert rise == pytest.approx(3.2e13 * plant.signals.tank_flow**2, rel=1e-4)
    assert rises[1] / rises[0] == pytest.approx(4.0, rel=0.05)


def test_ideal_supply_keeps_its_pressure_and_pays_for_every_litre(make_plant: MakePlant) -> None:
    """Without a pump in the model supply power is p_s q (S1 eq. 3.2), and load power its part."""
    plant = make_plant(bare(load_viscous_friction_coefficient=2000.0))
    plant.inputs.valve_current = 3e-3
    settle(plant, 0.05)
    s = plant.signals
    assert s.supply_pressure == P_S
    assert s.supply_power == pytest.approx(P_S * s.supply_flow)
    assert s.load_power == pytest.approx(s.load_force * s.velocity)
    assert 0.1 < s.efficiency < 1.0
    # 160 bar at 7.5 l/min is 2 kW
    assert pytest.approx(2000.0) == P_S * 7.5e-3 / 60
