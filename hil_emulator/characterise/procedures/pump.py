"""Volumetric efficiency of the pump against pressure, and the loss over a relief valve (S1 3.2).

The valve with joined ports is the load: opened in steps, it draws more flow at a lower pressure.
Two pumps of the size of the machine's pump, or of the catalogue's if the machine has no pump:

    variable displacement   99 % below 100 bar, about 90 % at 250 bar, at full stroke
    fixed displacement      the flow that the valve does not draw is lost over the relief valve
"""

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.pump_circuit import (
    at_full_stroke,
    current_for,
    pump_circuit,
    pump_flow,
    steady,
)
from hil_emulator.characterise.result import (
    Agreement,
    BenchResult,
    Comparison,
    DocumentFigure,
    column,
)
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

DOCUMENT_EFFICIENCY = {100e5: 0.99, 250e5: 0.90}
"""Efficiency of a variable-displacement pump, by pressure [Pa] (S1 3.2)."""
_ROUNDING = 1e-3  # tolerance of an efficiency in whole percent: a tenth of the smaller loss
_PARTS = np.linspace(0.0, 1.0, 21)  # openings of the valve, relative to that for the pump's flow
_CLOSED = {"underlap_lap": 0.0, "land_leakage_clearance": 0.0}
_TO_LITRES = 6e4  # m³/s -> l/min


def run(bench: Bench) -> BenchResult:
    """Load both pumps with the valve."""
    flow = pump_flow(bench)
    p_set = bench.value("supply_pressure")
    variable = at_full_stroke(bench, {}, ("pump_pressure", "pump_power", "supply_power"))
    p_v, efficiency = variable["pump_pressure"], variable["supply_power"] / variable["pump_power"]
    # lands of a large valve would draw the whole flow of a small pump
    stand = pump_circuit(bench, _CLOSED | {"fixed_pump_flow": flow})
    opening = _PARTS * current_for(bench, flow, p_set)
    names = ("pump_pressure", "pump_power", "supply_power", "relief_flow")
    p_f, power_f, useful_f, relief = np.array([steady(stand, float(u), names) for u in opening]).T
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "The valve with joined ports loads the pump, opened in 21 steps; power into the valve "
            "over power of the pump's flow."
        ),
        columns={
            "pressure, variable pump": column("bar", p_v * 1e-5),
            "efficiency, variable pump": column("%", efficiency * 100.0),
            "pressure, fixed pump": column("bar", p_f * 1e-5),
            "flow through the valve": column("l/min", (flow - relief) * _TO_LITRES),
            "loss over the relief valve": column("kW", (power_f - useful_f) * 1e-3),
        },
        comparisons=[
            *(
                Comparison(f"efficiency of a variable pump at {p * 1e-5:.0f} bar", "1", wanted,
                           "S1 3.2", float(np.interp(p, p_v, efficiency)), _ROUNDING,
                           Agreement.DOCUMENT)
                for p, wanted in DOCUMENT_EFFICIENCY.items()
            ),
            Comparison("loss of a fixed pump, valve closed", "kW", flow * p_set * 1e-3,
                       "q p (S1 eq. 3.2)", float(power_f[0] - useful_f[0]) * 1e-3, 0.02,
                       Agreement.DERIVED),
        ],
        notes=[f"Pumps of {flow * _TO_LITRES:.3g} l/min."],
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
    if result.figures:
        points = np.array(list(DOCUMENT_EFFICIENCY.items())).T
        variable.plot(points[0] * 1e-5, points[1] * 100.0, "s", color=BLACK, label="S1 3.2")
    variable.set_ylim(80.0, 101.0)
    look.label(variable, "pressure [bar]", "efficiency [%]", "Variable displacement, full stroke")
    look.legend(variable)
    fixed.plot(result["flow through the valve"], result["loss over the relief valve"], ".-",
               color=VERMILION)  # fmt: skip
    look.label(fixed, "flow drawn [l/min]", "power lost [kW]", "Fixed displacement, relief valve")


TEST = Procedure("pump", "Efficiency of the pump", run, draw, Chapter.PUMP, 1)
