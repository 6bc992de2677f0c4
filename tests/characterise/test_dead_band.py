"""Valves with a dead band, hysteresis and a slow spool: what applies, and its numbers."""

import json
import math
from collections.abc import Callable

import pytest

from hil_emulator.characterise.edges import Edges
from hil_emulator.characterise.procedures import (
    discharge,
    force_poles,
    lap,
    leakage,
    no_load,
    pressure_gain,
    valve_flow,
)
from hil_emulator.characterise.result import Agreement, BenchResult
from hil_emulator.characterise.stand import Bench
from hil_emulator.characterise.writing import as_json
from hil_emulator.model.plant import Plant

Put = Callable[..., Bench]

PROPORTIONAL = {
    "overlap_lap": 2e-3,
    "hysteresis_width": 3e-4,
    "threshold_current": 5e-5,
    "valve_natural_frequency": 35.0,
}
"""A proportional valve of 10 mA: a dead band of 20 %, loops of 3 % and 0.5 %."""


def wrong(result: BenchResult) -> list[str]:
    """Return what differs from the machine's own numbers."""
    json.dumps(as_json(result))  # what the command writes
    own_rows = [c for c in result.comparisons if c.kind is not Agreement.DOCUMENT]
    assert own_rows
    return [f"{c.quantity}: {c.measured:.4g}, {c.expected:.4g}" for c in own_rows if not c.agrees]


@pytest.mark.parametrize("test", [valve_flow, no_load, discharge])
def test_a_test_drives_the_valve_beyond_its_dead_band(bench: Put, test: object) -> None:
    """Gain, pressures of a free rod and discharge coefficients are those of open edges."""
    assert wrong(test.run(bench(**PROPORTIONAL))) == []  # type: ignore[attr-defined]


@pytest.mark.slow
@pytest.mark.parametrize("test", [pressure_gain, leakage])
def test_null_is_where_overlapped_lands_leak(bench: Put, test: object) -> None:
    """K_p = (p_s - p_t)/(u_c + 2 u_lap), and the leakage of lands that overlap."""
    leaking = bench(**PROPORTIONAL, land_leakage_clearance=1e-4)
    assert wrong(test.run(leaking)) == []  # type: ignore[attr-defined]


def test_the_configured_dead_band_comes_back(bench: Put) -> None:
    """2 mA less the clearance of 28 uA; a valve without overlap has no such number."""
    result = lap.run(bench(**PROPORTIONAL))
    assert wrong(result) == []
    (half,) = (c for c in result.comparisons if c.quantity.endswith("as configured"))
    assert half.measured == pytest.approx(2000.0 - 28.0, rel=0.01)
    assert any("no overlap" in reason for reason in lap.run(bench()).inapplicable)


def test_edges_closed_at_null_have_no_pressure_sensitivity(bench: Put) -> None:
    """Without leaking lands the test gives the reason instead of a number."""
    tight = bench(overlap_lap=2e-3, land_leakage_clearance=0.0)
    assert Edges.of(tight).null_width == 0.0
    assert "edges closed at null" in pressure_gain.run(tight).inapplicable[0]


@pytest.mark.slow
def test_the_oils_resonance_is_not_the_spools(bench: Put) -> None:
    """60 Hz of the mass on its oil at mid-stroke, whether the spool has 35 Hz or 250 Hz."""
    slow, quick = (force_poles.run(bench(valve_natural_frequency=f)) for f in (35.0, 250.0))
    for result in (slow, quick):
        hertz = math.hypot(result["real, exact"][9], result["imaginary, exact"][9]) / 2 / math.pi
        assert hertz == pytest.approx(60.5, rel=0.02)
        assert wrong(result) == []


@pytest.mark.parametrize("edge", ["sa", "sb", "at", "bt"])
def test_openings_are_those_of_the_model(bench: Put, edge: str) -> None:
    """Flow over K_v sqrt(dp) of one turbulent edge, with overlap, lap and gain of its own."""
    sign, chamber = (1 if edge in ("sa", "bt") else -1), edge[0 if edge[0] in "ab" else 1]
    machine = bench(**PROPORTIONAL | {
        f"gain_{edge}_excess": -0.5, f"lap_{edge}_lap": -1e-3, "gain_asymmetry_asymmetry": 0.1,
        "valve_critical_reynolds_number": 0.0, "valve_laminar_width": 1e3,
    })  # fmt: skip
    plant = Plant(machine.kernel, machine.values, 1e-5)
    plant.set_pressures(80e5, 80e5)
    plant.state.spool_position = sign * 6e-3
    plant.step(0)
    drop = 80e5 if "s" in edge else 79e5
    edges, root = Edges.of(machine), machine.value("valve_gain") * math.sqrt(drop)
    # the lands of the other edge at that port leak
    other = {"sa": "at", "at": "sa", "sb": "bt", "bt": "sb"}[edge]
    leak = edges.opening(sign * 6e-3, other) * machine.value("valve_gain") * math.sqrt(159e5 - drop)
    flow = abs(float(plant.signals[f"port_flow_{chamber}"]))
    assert flow == pytest.approx(edges.opening(sign * 6e-3, edge) * root - leak, rel=2e-3)
