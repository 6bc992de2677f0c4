"""Efficiency of the pump against pressure, and the loss over a relief valve (S1 3.2).

The valve, its ports joined, is the load: opened step by step it draws more flow at a lower
pressure. Two pumps, of the machine's own size where it has one, else of the catalogue's:

    variable displacement   99 % below 100 bar, some 90 % at 250 bar, at full stroke
    fixed displacement      what the valve does not draw passes the relief valve and is lost
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import (
    Agreement,
    BenchResult,
    Comparison,
    DocumentFigure,
    Series,
    column,
)
from hil_emulator.characterise.stand import Bench, Stand
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

DOCUMENT_EFFICIENCY = {100e5: 0.99, 250e5: 0.90}
"""Of a variable-displacement pump, by pressure [Pa] (S1 3.2)."""
_ROUNDING = 1e-3  # of an efficiency said in whole percent: a tenth of the smaller loss
_SET_HIGH = 280e5  # set pressure of the variable pump: at full stroke up to 270 bar [Pa]
_PARTS = np.linspace(0.0, 1.0, 21)  # openings of the valve, parts of the one for the pump's flow
_HELD = 1.0  # each opening [s]
_TO_LITRES = 6e4  # m³/s -> l/min


def _own_or_typical(bench: Bench, effect: str) -> float:
    """Return the knob of an effect: the machine's, or the catalogue's where it is off."""
    known = next(e for e in bench.kernel.effects if e.name == effect)
    own = bench.value(known.field_of(known.knob))
    return own if own != known.off else known.knob.typical


def _hold(stand: Stand, current: float) -> Series:
    """Return pump pressure, pump power, power into the valve, relief flow, steady."""
    signals = stand.drive(np.full(round(_HELD / stand.period), current)).signals
    names = ("pump_pressure", "pump_power", "supply_power", "relief_flow")
    late = slice(-round(0.1 * _HELD / stand.period), None)
    return np.array([float(np.mean(signals[name][late])) for name in names])


def _short_pipes(bench: Bench) -> dict[str, float]:
    """Return pipes and a meter that are steady long before that."""
    size = bench.valve_size
    return {
        "cylinder_dead_volume_a": size * 1e-3,
        "cylinder_dead_volume_b": size * 1e-3,
        "internal_leakage_conductance": size * 1e-8,
    }


def _sweep(bench: Bench, changes: dict[str, float], currents: Series) -> Series:
    """Return rows of pressure, pump power, valve power, relief flow; shape (4, currents)."""
    circuit = (
        bench.off("supply", "tank", "valve", keep=("underlap", "land_leakage"))
        | bench.joined()
        | _short_pipes(bench)
    )
    stand = bench.stand(circuit | changes)
    return np.array([_hold(stand, float(u)) for u in currents]).T


def _current_for(bench: Bench, flow: float, pressure: float) -> float:
    """Return the spool position that passes a flow through both edges at a pressure [A]."""
    drop = 0.5 * (pressure - bench.value("tank_pressure"))
    return flow / (bench.value("valve_gain") * math.sqrt(drop)) - bench.null_opening


def run(bench: Bench) -> BenchResult:
    """Load both pumps with the valve."""
    flow, leakage = (_own_or_typical(bench, n) for n in ("variable_pump", "pump_leakage"))
    fixed = _own_or_typical(bench, "fixed_pump")
    p_set = bench.value("supply_pressure")
    pressures = np.linspace(20e5, 265e5, len(_PARTS))[::-1]
    # about what is left of the flow there: it only places the points
    drawn = flow - leakage * pressures / 250e5
    currents = np.array([_current_for(bench, q, p) for q, p in zip(drawn, pressures, strict=True)])
    variable = {"supply_pressure": _SET_HIGH, "variable_pump_flow": flow,
                "pump_leakage_flow": leakage}  # fmt: skip
    p_v, power_v, useful_v, _ = _sweep(bench, variable, currents)
    opening = _PARTS * _current_for(bench, fixed, p_set)
    p_f, power_f, useful_f, relief = _sweep(bench, {"fixed_pump_flow": fixed}, opening)
    order = np.argsort(p_v)
    efficiency = (useful_v / power_v)[order]
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "The valve with joined ports loads the pump, opened in 21 steps; power into the valve "
            "over power that the pump's flow takes."
        ),
        columns={
            "pressure, variable pump": column("bar", p_v[order] * 1e-5),
            "efficiency, variable pump": column("%", efficiency * 100.0),
            "pressure, fixed pump": column("bar", p_f * 1e-5),
            "flow through the valve": column("l/min", (fixed - relief) * _TO_LITRES),
            "loss over the relief valve": column("kW", (power_f - useful_f) * 1e-3),
        },
        comparisons=[
            *(
                Comparison(f"efficiency of a variable pump at {p * 1e-5:.0f} bar", "1", wanted,
                           "S1 3.2", float(np.interp(p, p_v[order], efficiency)), _ROUNDING,
                           Agreement.DOCUMENT)
                for p, wanted in DOCUMENT_EFFICIENCY.items()
            ),
            Comparison("loss of a fixed pump, valve closed", "kW", fixed * p_set * 1e-3,
                       "q p (S1 eq. 3.2)", float(power_f[0] - useful_f[0]) * 1e-3, 0.02,
                       Agreement.DERIVED),
        ],
        notes=[f"Pumps of {flow * _TO_LITRES:.3g} and {fixed * _TO_LITRES:.3g} l/min."],
        figures=[
            DocumentFigure("S1 3.2", "99 % below 100 bar and about 90 % at 250 bar, of a pump with "
                           "variable displacement", "two points"),
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw efficiency against pressure, and the relief loss against flow."""
    variable, fixed = figure.subplots(1, 2)
    variable.plot(result["pressure, variable pump"], result["efficiency, variable pump"], ".-",
                  color=BLUE, label="emulated")  # fmt: skip
    points = np.array(list(DOCUMENT_EFFICIENCY.items())).T
    variable.plot(points[0] * 1e-5, points[1] * 100.0, "s", color=BLACK, label="S1 3.2")
    variable.set_ylim(80.0, 101.0)
    look.label(variable, "pressure [bar]", "efficiency [%]", "Variable displacement, full stroke")
    look.legend(variable)
    fixed.plot(result["flow through the valve"], result["loss over the relief valve"], ".-",
               color=VERMILION)  # fmt: skip
    look.label(fixed, "flow drawn [l/min]", "power lost [kW]", "Fixed displacement, relief valve")


TEST = Procedure("pump", "Efficiency of the pump", run, draw, Chapter.PUMP, 1)
