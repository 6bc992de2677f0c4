"""What the four metering edges pass, with turbulent flow: laps, gains, saturation, leakage."""

import math
from collections.abc import Callable

import pytest
from experiment import lock, settle
from reference_machine import K_V, P_S, P_T, bare, pond

from hil_emulator.model.plant import Plant

MakePlant = Callable[..., Plant]


def test_gain_asymmetry_is_the_ratio_of_both_speeds(make_plant: MakePlant) -> None:
    """A symmetric cylinder runs (1 + k)/(1 - k) times faster in the favoured direction."""
    speeds = []
    for current in (1e-3, -1e-3):
        plant = make_plant(
            bare(
                gain_asymmetry_asymmetry=0.05, cylinder_area_ratio=1.0, load_mass=5.0,
                viscous_friction_coefficient=100.0,
            )
        )  # fmt: skip
        plant.inputs.valve_current = current
        settle(plant, 0.15)
        speeds.append(abs(float(plant.signals.velocity)))
    assert speeds[0] / speeds[1] == pytest.approx(1.05 / 0.95, rel=2e-3)


def test_overlap_takes_its_lap_from_the_opening(make_plant: MakePlant) -> None:
    """Nothing flows within the lap; beyond it the flow grows as u - lap."""
    flows = []
    for current in (0.9e-4, 2e-4, 3e-4):
        plant = make_plant(pond(overlap_lap=1e-4, valve_critical_reynolds_number=0.0))
        plant.inputs.valve_current = current
        settle(plant, 0.02)
        flows.append(float(plant.signals.flow_a))
    assert flows[0] == 0.0
    assert flows[2] / flows[1] == pytest.approx(2.0, rel=1e-5)


EDGES = {"sa": (1, "a", P_S), "at": (-1, "a", P_T), "sb": (-1, "b", P_S), "bt": (1, "b", P_T)}
"""Of each edge: sign of the travel that opens it, its chamber, the pressure beyond it."""


def one_unlike_three(make_plant: MakePlant, unlike: str, lap: float, gain: float) -> None:
    """Hold four edges against q = K_v (1 + g) (u - lap) sqrt(dp), with one of another land."""
    changes = {f"lap_{unlike}_lap": lap, f"gain_{unlike}_excess": gain}
    plant = make_plant(pond(**changes, valve_critical_reynolds_number=0.0, valve_laminar_width=1e3))
    for edge, (sign, chamber, beyond) in EDGES.items():
        plant.set_pressures(80e5, 80e5)
        plant.state.spool_position = sign * 1e-3
        plant.step(0)
        opening = (1.0 + gain) * (1e-3 - lap) if edge == unlike else 1e-3
        flow = K_V * opening * math.sqrt(abs(beyond - 80e5))
        assert sign * plant.signals[f"flow_{chamber}"] == pytest.approx(flow, rel=1e-6)


def test_lap_sa_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-A opens 0.2 mA late; the others as ever."""
    one_unlike_three(make_plant, "sa", 2e-4, 0.0)


def test_lap_at_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """A-T opens 0.1 mA early."""
    one_unlike_three(make_plant, "at", -1e-4, 0.0)


def test_lap_sb_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-B opens 0.2 mA late."""
    one_unlike_three(make_plant, "sb", 2e-4, 0.0)


def test_lap_bt_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """B-T opens 0.1 mA early."""
    one_unlike_three(make_plant, "bt", -1e-4, 0.0)


def test_gain_sa_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-A is 5 % wider than the others."""
    one_unlike_three(make_plant, "sa", 0.0, 0.05)


def test_gain_at_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """A-T is 5 % narrower, and has a lap as well."""
    one_unlike_three(make_plant, "at", 2e-4, -0.05)


def test_gain_sb_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """P-B is 5 % wider."""
    one_unlike_three(make_plant, "sb", 0.0, 0.05)


def test_gain_bt_is_that_of_one_edge_alone(make_plant: MakePlant) -> None:
    """B-T is 5 % narrower, and open at null."""
    one_unlike_three(make_plant, "bt", -1e-4, -0.05)


def test_edges_of_different_lap_share_the_pressure_of_a_blocked_port(make_plant: MakePlant) -> None:
    """At null equal flows pass both edges of a: (p_s - p_a) u_sa² = (p_a - p_t) u_at².

    Of an underlap of 3 % P-A has lost 2 %, A-T has won 1 %; chamber b, unlike a, stays halfway.
    """
    plant = make_plant(bare(underlap_lap=3e-4, lap_sa_lap=2e-4, lap_at_lap=-1e-4, load_mass=1e5,
                            valve_critical_reynolds_number=0.0))  # fmt: skip
    lock(plant, 1.0)
    shares = 1.0**2, 4.0**2
    expected = (shares[0] * P_S + shares[1] * P_T) / sum(shares)
    assert plant.signals.pressure_a == pytest.approx(expected, rel=0.01)
    assert plant.signals.pressure_b == pytest.approx(0.5 * (P_S + P_T), rel=0.01)


def test_underlap_gives_the_published_pressure_sensitivity(make_plant: MakePlant) -> None:
    """Blocked ports: dp/du = p_s/u_0, 5.7e11 Pa/A for 28 uA (S1 3.5.1), within 2 %."""
    pressures = []
    for current in (-1e-6, 1e-6):
        plant = make_plant(bare(underlap_lap=28e-6, load_mass=1e5, tank_pressure=0.0,
                                valve_critical_reynolds_number=0.0))  # fmt: skip
        plant.inputs.valve_current = current
        lock(plant, 2.0)
        pressures.append((plant.signals.pressure_a, plant.signals.pressure_b))
        leakage = plant.signals.supply_flow
    (a_below, b_below), (a_above, b_above) = pressures
    assert (a_above - a_below) / 2e-6 == pytest.approx(5.7e11, rel=0.02)
    assert (b_above - b_below) / 2e-6 == pytest.approx(-5.7e11, rel=0.02)
    # and the leakage that comes with it where flow is turbulent: 2 K_v u_0 sqrt(p_s/2), 0.064 l/min
    assert leakage == pytest.approx(2 * K_V * 28e-6 * math.sqrt(P_S / 2), rel=0.01)


def test_flow_saturation_lets_edge_and_passage_share_the_drop(make_plant: MakePlant) -> None:
    """At the passage's own opening the flow is 1/sqrt(2) of that without it."""
    flows = []
    for passage in (math.inf, 5e-3):
        plant = make_plant(pond(flow_saturation_passage=passage))
        plant.inputs.valve_current = 5e-3
        plant.step(400)
        s = plant.signals
        flows.append(s.flow_a / math.sqrt(s.supply_pressure - s.pressure_a))
    assert flows[1] / flows[0] == pytest.approx(math.sqrt(0.5), rel=1e-4)
