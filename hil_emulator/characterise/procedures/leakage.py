"""Leakage of valve and cylinder with a clamped rod.

The current goes step by step through null, so that both chambers go from tank to supply pressure.
The flow meters in supply and tank line show the valve's leakage: at null both ports sit at half the
pressure and two lands pass C_d/0.6 K_v u_0 sqrt((p_s - p_t)/2) each, with the discharge coefficient
at the Reynolds number there. Beyond null what passes the closed lands is left, 1/(1 + 2 z/u_c) of
laminar flow past an overlap z. What flows into chamber a leaves it
past the piston and outwards: q_a = C_i (p_a - p_b) + C_e (p_a - p_atm).
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.discharge import TURBULENT, coefficient
from hil_emulator.characterise.procedures.pressure_gain import find_null
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import SMALL_CHAMBERS, Bench
from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.pages.palette import BLUE, VERMILION

_STEPS = np.linspace(-3.0, 3.0, 41)  # currents around null, in openings there
_HELD, _AVERAGED = 1.5, 0.3  # each step, and its end that counts [s]
_TO_LITRES = 6e4  # m³/s -> l/min


def _steady(bench: Bench, current: Series) -> tuple[Series, ...]:
    """Return p_a, p_b [Pa], flow into a and through the valve [m³/s] at each current."""
    ideal = bench.off("supply", "tank")
    clamped = bench.clamped(keep=("internal_leakage", "external_leakage"))
    # what leaks does not depend on the chambers' volumes; small ones settle in every machine
    stand = bench.stand(ideal | clamped | SMALL_CHAMBERS)
    rows = []
    for value in current:
        seen = stand.drive(np.full(round(_HELD / stand.period), value)).after(_HELD - _AVERAGED)
        # what leaks outwards passes one of the two meters only: their mean is the lands' share
        through = 0.5 * (seen.signals["supply_flow"] + seen.signals["tank_flow"])
        columns = (seen.readings["pressure_a"], seen.readings["pressure_b"],
                   seen.signals["flow_a"], through)  # fmt: skip
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


def _foot(bench: Bench, drop: float) -> float:
    """Return the flow past closed lands at the ends of the sweep [m³/s], 0 where none is known.

    Blocked between an open and a closed edge, a port splits the drop as the squares of both.
    """
    clearance = bench.value("land_leakage_clearance")
    if clearance < bench.null_opening or bench.value("internal_leakage_conductance") > 0.0:
        return 0.0
    z = float(_STEPS[-1])
    opens, closes = clearance * (1.0 + z), clearance / math.sqrt(1.0 + 2.0 * z)
    return 2.0 * _edge(bench, closes, drop * opens**2 / (opens**2 + closes**2))


def run(bench: Bench) -> BenchResult:
    """Measure leakage with flow meters in supply line, tank line and port a."""
    lap = bench.null_opening
    null = find_null(bench)
    current = null + _STEPS * (lap or 1e-3 * bench.rated_current)
    p_a, p_b, flow_a, through = _steady(bench, current)
    inner, outer = _conductances(p_a, p_b, flow_a)
    drop = bench.value("supply_pressure") - bench.value("tank_pressure")
    at_null = float(np.interp(0.0, p_a - p_b, through))
    lands = 2.0 * _edge(bench, lap, drop / 2.0) if lap else 0.0
    ends = 0.5 * float(through[0] + through[-1])
    expected = [
        ("valve leakage at null", "l/min", lands * _TO_LITRES, "2 C_d/0.6 K_v u_0 √((p_s - p_t)/2)",
         at_null * _TO_LITRES, 0.02, Agreement.DERIVED),
        (f"valve leakage {_STEPS[-1]:.0f} u_c from null", "l/min", _foot(bench, drop) * _TO_LITRES,
         "1/(1 + 2 z/u_c) of laminar flow", ends * _TO_LITRES, 0.02, Agreement.DERIVED),
        ("conductance past the piston", "m³/(s Pa)", _laminar(bench, "internal_leakage"),
         "configured; HyQ scripts: 1.7e-13", inner, 0.02, Agreement.CONFIGURED),
        ("conductance outwards", "m³/(s Pa)", _laminar(bench, "external_leakage"),
         "configured", outer, 0.02, Agreement.CONFIGURED),
    ]  # fmt: skip
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
        comparisons=[Comparison(*row) for row in expected if row[2] > 0.0],
        notes=[f"No {row[0]} configured." for row in expected if row[2] == 0.0],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the leakage of the valve and that of the piston."""
    valve, piston = figure.subplots(1, 2, sharey=True)
    valve.plot(result["current"], result["valve flow"], ".-", color=BLUE)
    look.label(valve, "current [uA]", "flow [l/min]", "Through the valve, rod clamped")
    piston.plot(result["pressure difference"], result["flow a"], ".-", color=VERMILION)
    look.label(piston, "p_a - p_b [bar]", "", "Into chamber a")


TEST = Procedure("leakage", "Leakage of valve and cylinder", run, draw, Chapter.VALVE, 3)
