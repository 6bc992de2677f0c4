"""Leakage of valve and cylinder with a clamped rod.

The current is stepped through null, so that both chambers go from tank to supply pressure. The flow
meters in supply and tank line measure the valve's leakage. At null both ports are at half the
pressure, and two lands pass C_d/0.6 K_v u_0 sqrt((p_s - p_t)/2) each, with the discharge
coefficient at this Reynolds number. Beyond null only the flow past the closed lands remains: 1/(1 +
2 z/u_c) of laminar flow past an overlap z, which the spool's transducer measures. The flow into
chamber a leaves past the piston and outwards: q_a = C_i (p_a - p_b) + C_e (p_a - p_atm).
"""

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.edges import Edges, loop, loop_reach
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.discharge import TURBULENT, coefficient
from hil_emulator.characterise.procedures.pressure_gain import find_null
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import SMALL_CHAMBERS, Bench
from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.pages.palette import BLUE, VERMILION

_STEPS = np.linspace(-1.0, 1.0, 41)  # currents around null, parts of the sweep about it
_TIGHT = 3e-3  # sweep for tight edges, part of the rated current
_HELD, _AVERAGED = 1.5, 0.3  # length of each step, and of its averaged end [s]
_TO_LITRES = 6e4  # m³/s -> l/min


def _steady(bench: Bench, below: float, current: Series) -> tuple[Series, ...]:
    """Return p_a, p_b [Pa], flow into a and through the valve [m³/s] and spool [A] per current."""
    ideal = bench.off("supply", "tank")
    clamped = bench.clamped(keep=("internal_leakage", "external_leakage"))
    # leakage does not depend on the chambers' volumes; small ones settle quickly
    stand = bench.stand(ideal | clamped | SMALL_CHAMBERS)
    stand.drive(np.linspace(below, current[0], round(_HELD / stand.period)))
    rows = []
    for value in current:
        record = stand.drive(np.full(round(_HELD / stand.period), value)).after(_HELD - _AVERAGED)
        # leakage outwards passes only one of the two meters: their mean is the flow of the lands
        through = 0.5 * (record.signals["supply_flow"] + record.signals["tank_flow"])
        columns = (record.readings["pressure_a"], record.readings["pressure_b"],
                   record.signals["flow_a"], through, record.signals["spool_position"])  # fmt: skip
        rows.append([float(np.mean(c)) for c in columns])
    return tuple(np.array(rows).T)


def _conductances(p_a: Series, p_b: Series, flow: Series) -> tuple[float, float]:
    """Return conductance past the piston and outwards by least squares [m³/(s Pa)]."""
    columns = np.column_stack([p_a - p_b, p_a - ATMOSPHERE])
    inner, outer = np.linalg.lstsq(columns, flow, rcond=None)[0]
    return float(inner), float(outer)


def _laminar(bench: Bench, effect: str) -> float:
    """Return a configured conductance at the temperature of the oil [m³/(s Pa)]."""
    return bench.value(f"{effect}_conductance") / bench.relative_viscosity


def _edge(bench: Bench, opening: float, drop: float) -> float:
    """Return the flow through an edge at an opening [A] and a drop [Pa]."""
    part = coefficient(bench, opening, drop) / TURBULENT
    return part * bench.value("valve_gain") * opening * math.sqrt(drop)


def _foot(bench: Bench, travel: float, drop: float) -> float:
    """Return the flow past closed lands at a travel from null [m³/s], 0 for tight lands.

    A blocked port between an open and a closed edge divides the pressure drop by the squares of
    both openings.
    """
    edges = Edges.of(bench)
    if not edges.clearance:
        return 0.0
    opens, closes = edges.opening(travel), edges.opening(-travel)
    return 2.0 * _edge(bench, closes, drop * opens**2 / (opens**2 + closes**2))


@dataclass(frozen=True)
class _Meters:
    """Readings of the meters: leakage at null and at the ends [m³/s], and both conductances."""

    at_null: float
    ends: float
    travel: float
    inner: float
    outer: float


def _comparisons(bench: Bench, meters: _Meters) -> list[Comparison]:
    """Compare with the configured machine; an expected 0 means that the leakage is absent."""
    edges = Edges.of(bench)
    lap = edges.opening(0.0)
    drop = bench.value("supply_pressure") - bench.value("tank_pressure")
    lands = 2.0 * _edge(bench, lap, drop / 2.0) if lap else 0.0
    at = f"{meters.travel / edges.clearance:.2g} u_c" if edges.clearance else "beyond u_0"
    foot = 0.0 if bench.value("internal_leakage_conductance") else _foot(bench, meters.travel, drop)
    rows = [
        ("valve leakage at null", "l/min", lands * _TO_LITRES, "2 C_d/0.6 K_v u_0 √((p_s - p_t)/2)",
         meters.at_null * _TO_LITRES, 0.02, Agreement.DERIVED),
        (f"valve leakage {at} from null", "l/min", foot * _TO_LITRES,
         "1/(1 + 2 z/u_c) of laminar flow", meters.ends * _TO_LITRES, 0.02, Agreement.DERIVED),
        ("conductance past the piston", "m³/(s Pa)", _laminar(bench, "internal_leakage"),
         "configured; HyQ scripts: 1.7e-13", meters.inner, 0.02, Agreement.CONFIGURED),
        ("conductance outwards", "m³/(s Pa)", _laminar(bench, "external_leakage"),
         "configured", meters.outer, 0.02, Agreement.CONFIGURED),
    ]  # fmt: skip
    return [Comparison(*row) for row in rows]


def _reason(bench: Bench, quantity: str) -> str:
    """Return the reason why a quantity does not apply."""
    if quantity.startswith("valve leakage") and bench.value("land_leakage_clearance"):
        return f"{quantity}: the piston leaks, so the ports are not blocked."
    return f"{quantity}: the configuration has no such leakage."


def run(bench: Bench) -> BenchResult:
    """Measure leakage with flow meters in supply line, tank line and port a."""
    sweep = Edges.of(bench).about_null or _TIGHT * bench.rated_current
    current = find_null(bench) + 0.5 * loop(bench) + _STEPS * sweep
    # starts so far below that the spool is on the rising side of its loop
    below = current[0] - loop_reach(bench)
    p_a, p_b, flow_a, through, spool = _steady(bench, below, current)
    meters = _Meters(
        float(np.interp(0.0, p_a - p_b, through)), 0.5 * float(through[0] + through[-1]),
        0.5 * float(spool[-1] - spool[0]), *_conductances(p_a, p_b, flow_a),
    )  # fmt: skip
    comparisons = _comparisons(bench, meters)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Rod clamped, chambers of 1 ml, the current held at 41 values around null for 1.5 s "
            "each; flow meters in supply line, tank line and port a, chamber pressures from the "
            "sensors."
        ),
        columns={
            "current": column("uA", current * 1e6),
            "pressure difference": column("bar", (p_a - p_b) * 1e-5),
            "flow a": column("l/min", flow_a * _TO_LITRES),
            "valve flow": column("l/min", through * _TO_LITRES),
        },
        comparisons=[c for c in comparisons if c.expected > 0.0],
        again=lambda other: _comparisons(other, meters),
        inapplicable=[_reason(bench, c.quantity) for c in comparisons if c.expected == 0.0],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the leakage of the valve and that of the piston."""
    valve, piston = figure.subplots(1, 2, sharey=True)
    valve.plot(result["current"], result["valve flow"], ".-", color=BLUE)
    look.label(valve, "current [uA]", "flow [l/min]", "Through the valve, rod clamped")
    piston.plot(result["pressure difference"], result["flow a"], ".-", color=VERMILION)
    look.label(piston, "p_a - p_b [bar]", "", "Into chamber a")


TEST = Procedure("leakage", "Leakage of valve and cylinder", run, draw, Chapter.VALVE, 3)
