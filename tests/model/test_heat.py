"""The oil's temperature against a closed form and scipy."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import settle
from reference_machine import bare
from scipy.integrate import solve_ivp

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]
RHO, HEAT = 850.0, 1900.0


def test_oil_heating_ends_where_cooling_takes_all_losses(make_plant: MakePlant) -> None:
    """A constant loss warms the oil as 1 - exp(-t/tau), tau = rho c V/(G_w + G_c)."""
    volume, conductance, p_s, p_t = 1e-4, 1e-11, 160e5, 1e5
    plant = make_plant(
        bare(pilot_leakage_conductance=conductance, oil_heating_volume=volume, load_mass=1e5)
    )
    loss, start = conductance * (p_s - p_t) ** 2, 313.15
    tau = RHO * HEAT * volume / 110.0
    # the cooler begins where the oil is; walls lose to 20 °C
    end = start + (loss - 10.0 * 20.0) / 110.0
    for t in (1.0, 2.0, 3.0):
        settle(plant, 1.0)
        exact = end + (start - end) * math.exp(-t / tau)
        assert float(plant.signals.oil_temperature) == pytest.approx(exact, abs=1e-3)
    assert end > start + 10.0


def test_oil_heating_runs_away_with_the_pumps_gaps(make_plant: MakePlant) -> None:
    """Warm oil is thin and leaks more: the feedback as LSODA has it with Walther's viscosity."""
    volume, flow, p_s = 2e-4, 1e-3 / 60, 250e5
    plant = make_plant(
        bare(
            supply_pressure=p_s, pump_leakage_flow=flow, viscosity_temperature_slope=3.68,
            oil_temperature=303.15, oil_heating_volume=volume, load_mass=1e5,
        )
    )  # fmt: skip

    def walther(t: float) -> float:
        level = math.log10(math.log10(46.7)) - 3.68 * math.log10(t / 313.15)
        return float((10 ** (10**level) - 0.7) / 46.0)

    def rate(_: float, t: np.ndarray) -> list[float]:
        loss = flow * p_s / walther(t[0])
        taken = 10.0 * (t[0] - 293.15) + 100.0 * max(0.0, t[0] - 313.15)
        return [(loss - taken) / (RHO * HEAT * volume)]

    exact = solve_ivp(rate, (0.0, 4.0), [303.15], method="LSODA", rtol=1e-9).y[0, -1]
    for _ in range(400):
        plant.step(500)
    assert exact > 305.0
    assert float(plant.signals.oil_temperature) == pytest.approx(exact, abs=0.01)
    assert float(plant.signals.viscosity) == pytest.approx(46e-6 * walther(exact), rel=1e-3)


def test_oil_heating_takes_what_valve_pump_and_relief_valve_turn_into_heat(
    make_plant: MakePlant,
) -> None:
    """All that turns a fixed pump while the rod rests is heat: rho c V dT = the shaft's work."""
    volume = 1e-3
    plant = make_plant(
        bare(
            fixed_pump_flow=10e-3 / 60, oil_heating_volume=volume, oil_heating_wall=0.0,
            oil_heating_cooler=0.0, pump_leakage_flow=1e-3 / 60, pilot_leakage_conductance=1e-12,
            load_mass=1e5, pump_friction_coefficient=0.045,
        )
    )  # fmt: skip
    settle(plant, 1.0)
    before, work = float(plant.signals.oil_temperature), 0.0
    for _ in range(500):
        plant.step(50)
        work += 1e-3 * float(plant.signals.shaft_power)
    stored = RHO * HEAT * volume * (float(plant.signals.oil_temperature) - before)
    assert work > 100.0
    assert stored == pytest.approx(work, rel=2e-3)
