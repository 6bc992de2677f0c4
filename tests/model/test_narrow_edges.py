"""Edges that are hardly open and lands that are closed: laminar flow, and its way to turbulence."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from experiment import settle
from reference_machine import K_V, P_S, ballistic, pond

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]


SLOT, RHO, C_D = 0.025, 850.0, 0.6
WIDTH = K_V * math.sqrt(RHO / 2) / (C_D * SLOT)
"""Width of an edge's slot [m]: its area is what K_v u stands for at C_d = 0.6."""


def through(plant: Plant, current: float) -> tuple[float, float]:
    """Return flow and drop of the edge from s to a, with the spool held."""
    plant.inputs.valve_current = current
    plant.state.spool_position = current
    plant.step(0)
    return float(plant.signals.flow_a), float(
        plant.signals.supply_pressure - plant.state.pressure_a
    )


@pytest.mark.parametrize("viscosity", [46e-6, 200e-6])
def test_a_narrow_edge_passes_what_creeps_through_a_slit(
    viscosity: float, make_plant: MakePlant
) -> None:
    """Flow is pi x² w dp/(32 mu), exact for Stokes' equations (Wuest 1954), within 1 %."""
    plant = make_plant(pond(oil_kinematic_viscosity=viscosity, valve_laminar_width=1e3))
    for pressure in (159.9e5, 155e5, 130e5):
        plant.set_pressures(pressure, 80e5)
        flow, drop = through(plant, 5e-5)
        slot = SLOT * 5e-5
        creeping = math.pi * slot**2 * WIDTH * drop / (32 * viscosity * RHO)
        assert flow == pytest.approx(creeping, rel=0.01)


def test_a_wide_edge_is_turbulent(make_plant: MakePlant) -> None:
    """At Re = 1000 the flow is C_d x w sqrt(2 dp/rho) with C_d = 0.6 (S1 3.3.2), within 0.1 %."""
    plant = make_plant(pond())
    flow, drop = through(plant, 1e-2)
    speed = math.sqrt(2 * drop / RHO)
    assert 2 * flow / (WIDTH * 46e-6) > 900
    assert flow == pytest.approx(C_D * SLOT * 1e-2 * WIDTH * speed, rel=1e-3)


def test_one_law_leads_from_laminar_to_turbulent(make_plant: MakePlant) -> None:
    """Flow grows with a power of the drop between 1 and 1/2, from there to there, at any opening.

    The Reynolds number of the change, 2 q/(w nu) of a slit, is one and the same.
    """
    changes = []
    for current in (1e-4, 3e-4, 1e-3):
        plant = make_plant(pond(valve_laminar_width=1e3, supply_pressure=400e5))
        points = []
        for drop in np.geomspace(10.0, 390e5, 80):
            plant.set_pressures(400e5 - float(drop), 80e5)
            points.append(through(plant, current))
        flow, drop = np.log(np.array(points)).T
        power = np.diff(flow) / np.diff(drop)
        assert np.all(np.diff(power) < 1e-3)
        assert power[0] == pytest.approx(1.0, abs=0.01 if current < 5e-4 else 0.1)
        assert 0.49 < power[-1] < (0.55 if current > 2e-4 else 0.8)
        changes.append(2 * math.exp(np.interp(-0.75, -power, flow[1:])) / (WIDTH * 46e-6))
    assert changes == pytest.approx([changes[0]] * 3, rel=0.1)


def blocked(make_plant: MakePlant, current: float, **values: float) -> Plant:
    """Return a valve with blocked ports, 0.3 ml behind each, at their steady pressures."""
    drillings = {"cylinder_dead_volume_a": 3e-7, "cylinder_dead_volume_b": 3e-7}
    still = {"tank_pressure": 0.0, "valve_laminar_width": 1e3, **drillings}
    plant = make_plant(ballistic(**still, **values))
    plant.inputs.valve_current = plant.state.spool_position = current
    settle(plant, 1.0)
    return plant


def test_underlap_gives_the_same_null_in_laminar_and_turbulent_flow(make_plant: MakePlant) -> None:
    """Both edges of a blocked port balance opening times root of the drop, whatever the law."""
    pressures = []
    for critical in (0.0, 14.7, 500.0):
        law = {"valve_critical_reynolds_number": critical}
        plant = blocked(make_plant, 4e-5, underlap_lap=1e-4, **law)
        pressures.append(float(plant.signals.pressure_a))
    share = 1.4**2 / (1.4**2 + 0.6**2)
    assert pressures == pytest.approx([P_S * share] * 3, rel=1e-3)


def test_land_leakage_gives_the_published_pressure_sensitivity(make_plant: MakePlant) -> None:
    """Zero lap with a clearance worth 28 uA: dp/du = 5.7e11 Pa/A as well (S1 3.5.1), within 2 %."""
    below, above = (
        blocked(make_plant, current, land_leakage_clearance=28e-6) for current in (-2e-7, 2e-7)
    )
    rise = float(above.signals.pressure_a - below.signals.pressure_a)
    assert rise / 4e-7 == pytest.approx(5.7e11, rel=0.02)


def test_land_leakage_has_a_peak_at_null_and_a_foot_of_an_annular_gap(
    make_plant: MakePlant,
) -> None:
    """Past an overlap z the leakage falls as 1/(z + l), to that of a gap w c³ dp/(12 mu z)."""
    clearance = 28e-6
    laps = np.array([0.0, 0.3, 1.0, 3.0, 10.0, 30.0]) * clearance
    through = np.array([
        float(blocked(make_plant, float(z), land_leakage_clearance=clearance).signals.supply_flow)
        for z in laps
    ])  # fmt: skip
    assert np.all(np.diff(through) < 0.0)
    mirrored = blocked(make_plant, -float(laps[3]), land_leakage_clearance=clearance)
    assert mirrored.signals.supply_flow == pytest.approx(through[3], rel=1e-6)
    # far out the closed lands carry the whole drop: 1/q is a straight line over z
    z, inverse = laps[3:], 1.0 / through[3:]
    slope, at_null = np.polyfit(z, inverse, 1)
    assert at_null / slope == pytest.approx(0.5 * clearance, rel=0.1)
    assert np.polyval((slope, at_null), z) == pytest.approx(inverse, rel=0.02)
    gap = 0.84 * SLOT * clearance
    # two lands, one from s to b and one from a to t
    foot = 2.0 * WIDTH * gap**3 * P_S / (12 * 46e-6 * RHO * SLOT * laps[-1])
    assert through[-1] == pytest.approx(foot, rel=0.05)


def test_land_leakage_falls_with_the_overlap_of_the_lands(make_plant: MakePlant) -> None:
    """Lands that overlap by ten clearances leak a twentieth of those that meet the ports' edges."""
    flows = [
        float(blocked(make_plant, 0.0, land_leakage_clearance=5e-5, overlap_lap=lap)
              .signals.supply_flow) for lap in (0.0, 5e-4)
    ]  # fmt: skip
    assert flows[1] / flows[0] == pytest.approx(1.0 / 21.0, rel=0.02)


def test_series_resistance_adds_a_laminar_and_a_turbulent_drop(make_plant: MakePlant) -> None:
    """The drop is 32 mu q/(pi x² w) + (q/(K u))², from laminar to turbulent, within 0.5 %."""
    plant = make_plant(pond(series_resistance_share=1.0, valve_laminar_width=1e3))
    for current in (5e-5, 5e-4, 5e-3):
        for pressure in (155e5, 80e5):
            plant.set_pressures(pressure, 80e5)
            flow, drop = through(plant, current)
            laminar = 32 * 46e-6 * RHO * flow / (math.pi * (SLOT * current) ** 2 * WIDTH)
            turbulent = (flow / (K_V * current)) ** 2
            assert drop == pytest.approx(laminar + turbulent, rel=5e-3)
