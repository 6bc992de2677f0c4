"""A changed machine changes what the bench shows, and by the right amount."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.characterise.procedures import (
    bulk_modulus,
    discharge,
    friction,
    friction_steady,
    leakage,
    natural_frequency,
    pressure_gain,
    pump,
    sensors,
    spool_response,
    valve_flow,
)
from hil_emulator.characterise.result import BenchResult
from hil_emulator.characterise.stand import Bench

Put = Callable[..., Bench]


def measured(result: BenchResult, beginning: str) -> float:
    """Return what was measured of the first quantity whose name begins so."""
    return next(c.measured for c in result.comparisons if c.quantity.startswith(beginning))


@pytest.mark.slow
def test_a_worn_valve_loses_pressure_sensitivity(bench: Put) -> None:
    """Twice the clearance halves the slope at null; what creeps through a slit is four times."""
    worn = bench(land_leakage_clearance=56e-6)
    assert measured(pressure_gain.run(worn), "pressure sensitivity K_pa") == pytest.approx(
        159e5 / 56e-6, rel=0.02
    )
    assert measured(leakage.run(worn), "valve leakage") == pytest.approx(4 * 0.01069, rel=0.02)


def test_the_null_is_found_where_it_is(bench: Put) -> None:
    """A null bias of 0.1 mA moves the crossing of both pressures to -0.1 mA."""
    assert pressure_gain.find_null(bench(null_bias_bias=1e-4)) == pytest.approx(-1e-4, abs=1e-6)


@pytest.mark.slow
def test_piston_leakage_is_told_from_valve_leakage(bench: Put) -> None:
    """Both conductances are measured correctly, and the valve leakage is unchanged."""
    leaking = bench(internal_leakage_conductance=1.7e-13, external_leakage_conductance=2e-14)
    result = leakage.run(leaking)
    assert measured(result, "conductance past") == pytest.approx(1.7e-13, rel=0.02)
    assert measured(result, "conductance outwards") == pytest.approx(2e-14, rel=0.02)
    assert measured(result, "valve leakage") == pytest.approx(0.01069, rel=0.02)


def test_a_gain_that_depends_on_direction_shows_in_the_flow_curve(bench: Put) -> None:
    """±5 % of asymmetry make the flows at full current in both directions differ by 10 %."""
    flow = valve_flow.run(bench(gain_asymmetry_asymmetry=0.05))["flow"]
    assert flow.max() / -flow.min() == pytest.approx(1.05 / 0.95, rel=2e-3)


@pytest.mark.slow
def test_a_spool_without_rate_limit_has_one_bandwidth(bench: Put) -> None:
    """It is the rate limit that makes the full-amplitude bandwidth smaller."""
    notes = spool_response.run(bench(spool_rate_limit_rate=np.inf)).comparisons
    assert [c.measured for c in notes] == pytest.approx([250.0, 250.0], rel=0.02)


def test_more_air_softens_the_oil_at_low_pressure(bench: Put) -> None:
    """Ten times the air: softer at 10 bar, hardly changed at 200 bar, still on the expression."""
    foamy = bulk_modulus.run(bench(entrained_air_fraction=0.01))
    assert measured(foamy, "effective bulk modulus at 10 bar") < 500.0
    assert measured(foamy, "effective bulk modulus at 200 bar") > 1280.0
    assert all(c.agrees for c in foamy.comparisons)


@pytest.mark.slow
def test_a_pilot_stage_at_lower_pressure_is_slower(bench: Put) -> None:
    """With the pilot fed from the supply, 160 bar give sqrt(160/210) of both bandwidths."""
    result = spool_response.run(bench(pilot_supply_share=1.0)).comparisons
    slower = math.sqrt(160.0 / 210.0)
    assert [c.measured for c in result] == pytest.approx(
        [250.0, 100.0, 250.0 * slower, 100.0 * slower], rel=0.05
    )


def test_cold_oil_is_laminar_for_longer(bench: Put) -> None:
    """At 0 °C, eight times as thick, oil creeps through an edge that is turbulent at 40 °C."""
    law = {"viscosity_temperature_slope": 3.68}
    warm = discharge.run(bench(oil_temperature=313.15, **law))
    cold = discharge.run(bench(oil_temperature=273.15, **law))
    assert measured(cold, "C_d at 10%") < 0.3 * measured(warm, "C_d at 10%")
    assert measured(cold, "C_d at 2% opening and 0.1") < 0.15 * measured(
        warm, "C_d at 2% opening and 0.1"
    )
    assert all(c.agrees for c in cold.comparisons)


def test_cold_oil_damps_more(bench: Put) -> None:
    """Viscous friction at 20 °C and 60 °C comes back scaled by Walther's viscosity."""
    cold, warm = (
        friction_steady.run(bench(oil_temperature=t, viscosity_temperature_slope=3.68))
        for t in (293.15, 333.15)
    )
    assert measured(cold, "viscous") > 2000.0 > 1000.0 > 600.0 > measured(warm, "viscous")
    assert all(c.agrees for c in (*cold.comparisons, *warm.comparisons))


def test_a_leaking_pump_is_less_efficient(bench: Put) -> None:
    """Twice the leakage doubles the loss at 250 bar."""
    worn = pump.run(bench(pump_leakage_flow=2e-3 / 60.0))
    assert measured(worn, "efficiency of a variable pump at 250") == pytest.approx(0.80, abs=0.01)


def test_delays_of_a_channel_are_measured(bench: Put) -> None:
    """Dead time, and half the window of the velocity estimator (S2 eq. 9-10)."""
    honest = bench()
    slow = {
        "pressure_a": {"delay_time": 2e-3},
        "velocity": {"velocity_estimator_window": 10e-3},
    }
    channels = {name: dict(honest.sensors.get(name, {})) | more for name, more in slow.items()}
    result = sensors.run(replace(honest, sensors=dict(honest.sensors) | channels))
    assert measured(result, "delay of pressure a") == pytest.approx(2.0, rel=0.05)
    assert measured(result, "delay of velocity") == pytest.approx(5.0, rel=0.02)


def test_lags_shorter_than_a_tick_are_measured(bench: Put) -> None:
    """A lag delays slow motion by its time constant, a Butterworth filter by sqrt(2)/w."""
    honest = bench()
    slow = {
        "pressure_a": {"lag_time_constant": 5e-4},
        "position": {"lag_time_constant": 2e-4, "resolution_step": 0.0},
        "load_force": {"anti_aliasing_cut_off": 200.0, "noise_sigma": 0.0},
    }
    channels = {name: dict(honest.sensors.get(name, {})) | more for name, more in slow.items()}
    result = sensors.run(replace(honest, sensors=dict(honest.sensors) | channels))
    assert measured(result, "delay of pressure a") == pytest.approx(0.5, abs=0.02)
    assert measured(result, "delay of position") == pytest.approx(0.2, abs=0.002)
    late = 1e3 * math.sqrt(2.0) / (2.0 * math.pi * 200.0)
    assert measured(result, "delay of load force") == pytest.approx(late, abs=0.005)


@pytest.mark.parametrize("procedure", [friction, friction_steady])
def test_another_friction_is_recovered(bench: Put, procedure: object) -> None:
    """B = 700 N s/m and F_c0 = 60 N come back from the sensors within 3 %."""
    other = bench(viscous_friction_coefficient=700.0, coulomb_friction_force=60.0)
    result = procedure.run(other)  # type: ignore[attr-defined]
    assert measured(result, "viscous") == pytest.approx(700.0, rel=0.03)
    assert measured(result, "Coulomb") == pytest.approx(60.0, rel=0.03)


def test_breakaway_shows_at_low_speed(bench: Put) -> None:
    """The sines give the Stribeck excess together with B and F_c0."""
    result = friction.run(bench(stribeck_friction_excess=100.0))
    assert measured(result, "Stribeck") == pytest.approx(100.0, rel=0.15)
    assert measured(result, "viscous") == pytest.approx(1000.0, rel=0.03)
    assert measured(result, "Coulomb") == pytest.approx(100.0, rel=0.03)


def test_friction_is_seen_through_the_sensors(bench: Put) -> None:
    """A load cell that reads 4 % low shows 4 % of the load's drag as viscous friction."""
    honest = bench()
    cell = dict(honest.sensors["load_force"]) | {"gain_error_relative": -0.04}
    low = replace(honest, sensors=dict(honest.sensors) | {"load_force": cell})
    added = measured(friction_steady.run(low), "viscous") - measured(
        friction_steady.run(honest), "viscous"
    )
    assert added == pytest.approx(0.04 * 500.0, rel=0.3)


@pytest.mark.slow
def test_four_times_the_mass_halves_the_natural_frequency(bench: Put) -> None:
    """The springs stay; the damping ratio halves too."""
    light, heavy = (natural_frequency.run(bench(load_mass=mass)) for mass in (50.0, 200.0))
    for quantity in ("natural frequency at 40 mm", "damping ratio at 40 mm"):
        halved = measured(light, quantity) / measured(heavy, quantity)
        assert halved == pytest.approx(2.0, rel=0.02)


def test_the_oil_columns_are_derivatives_of_the_chambers_force(bench: Put) -> None:
    """K is -dF/dx of two closed chambers whose oil obeys p = p_0 - E ln(V/V_0), without air."""
    area, alpha, modulus, dead, x, dx = 201.06e-6, 0.61, 1.3e9, 3e-6, 0.02, 1e-7

    def force(to: float) -> float:
        volumes = [(dead + area * at, dead + alpha * area * (0.08 - at)) for at in (x, to)]
        p_a, p_b = (-modulus * math.log(new / old) for old, new in zip(*volumes, strict=True))
        return area * (p_a - alpha * p_b)

    slope = (force(x + dx) - force(x - dx)) / (2.0 * dx)
    pure = bench(entrained_air_fraction=0.0)
    assert natural_frequency.stiffness(pure, x, 60e5, 99e5) == pytest.approx(-slope, rel=1e-5)
