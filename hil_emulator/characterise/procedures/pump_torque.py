"""Torque at the pump's shaft, and with it the pump's three efficiencies (S1 3.2 and Table 3.1).

The valve with joined ports loads the machine's variable pump at full stroke, from 20 to 265 bar.
The shaft's torque is a straight line, T = D (1 + C_f) p + D p_d nu/nu_40 with D = q_0/omega. The
heat follows from the oil temperature: without heat loss all power at the shaft becomes heat, rho c
V dT/dt = omega T.
"""

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.pump_circuit import (
    SET_HIGH,
    at_full_stroke,
    configured_or_typical,
    current_for,
    pump_circuit,
    pump_flow,
    settling,
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
from hil_emulator.pages.palette import BLACK, BLUE, SKY, VERMILION

DOCUMENT_PRESSURE, DOCUMENT_OVERALL = 160e5, 0.90
"""Overall efficiency of S1 Table 3.1, at HyQ's supply pressure [Pa]; the table has no pressure."""

_TOLERANCE = 1e-3
_SIGNALS = ("pump_pressure", "shaft_torque", "shaft_power", "pump_power", "supply_power")
# without tank pressure, because hydraulic power is relative to absolute pressure 0
_INSULATED = {"oil_heating_wall": 0.0, "oil_heating_cooler": 0.0, "tank_pressure": 0.0}
_OIL_PER_FLOW = 60.0  # oil volume of that circuit over the pump's flow [s]
_HALF_POWER = 135e5  # pressure at which the heat is measured [Pa]


def _warming(bench: Bench, changes: dict[str, float], flow: float) -> tuple[float, float]:
    """Return heat flow into the oil, and the shaft's power [W]."""
    volume = _OIL_PER_FLOW * flow
    heated = changes | _INSULATED | {"oil_heating_volume": volume, "variable_pump_flow": flow,
                                     "supply_pressure": SET_HIGH}  # fmt: skip
    stand = pump_circuit(bench, heated)
    current = current_for(bench, flow, _HALF_POWER)
    for _ in range(settling(bench, flow, _HALF_POWER)):
        steady(stand, current, ())
    before = float(stand.plant.signals.oil_temperature)
    record = stand.drive(np.full(round(1.0 / stand.period), current))
    rise = float(record.signals["oil_temperature"][-1]) - before
    specific = bench.value("oil_heating_specific_heat")
    heat = bench.value("oil_density") * specific * volume * rise
    return heat, float(np.mean(record.signals["shaft_power"]))


def run(bench: Bench) -> BenchResult:
    """Load the pump with the valve."""
    flow, friction = pump_flow(bench), configured_or_typical(bench, "pump_friction")
    rubbing = {"pump_friction_coefficient": friction}
    signals = at_full_stroke(bench, rubbing, _SIGNALS)
    pressure, torque = signals["pump_pressure"], signals["shaft_torque"]
    displacement = flow / bench.value("supply_pump_speed")
    slope, start = np.polyfit(pressure, torque / displacement, 1)
    drag = bench.value("pump_friction_drag") * bench.relative_viscosity
    overall = signals["supply_power"] / signals["shaft_power"]
    mechanical = signals["pump_power"] / signals["shaft_power"]
    heat, power = _warming(bench, rubbing, flow)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "The valve with joined ports loads the pump at full stroke, opened in 21 steps; torque "
            "at the shaft, power into the valve over power at the shaft. Then the warming of the "
            f"oil at {_HALF_POWER * 1e-5:.0f} bar without cooler and walls, for 1 s."
        ),
        columns={
            "pressure": column("bar", pressure * 1e-5),
            "torque": column("N m", torque),
            "volumetric efficiency": column("%", overall / mechanical * 100.0),
            "mechanical efficiency": column("%", mechanical * 100.0),
            "overall efficiency": column("%", overall * 100.0),
        },
        comparisons=[
            Comparison(f"overall efficiency at {DOCUMENT_PRESSURE * 1e-5:.0f} bar", "1",
                       DOCUMENT_OVERALL, "S1 Table 3.1",
                       float(np.interp(DOCUMENT_PRESSURE, pressure, overall)), _TOLERANCE,
                       Agreement.DOCUMENT),
            Comparison("heat of the oil, nothing driven", "W", power, "power at the shaft", heat,
                       _TOLERANCE, Agreement.DERIVED),
            Comparison("torque per pressure over displacement", "1", 1.0 + friction,
                       "1 + C_f, configured", float(slope), _TOLERANCE, Agreement.CONFIGURED),
            Comparison("torque of the drag over displacement", "bar", drag * 1e-5,
                       "p_d nu/nu_40, configured", float(start) * 1e-5, _TOLERANCE,
                       Agreement.CONFIGURED),
        ],
        notes=[f"Pump of {displacement * 2e6 * np.pi:.3g} cm³ per turn."],
        figures=[
            DocumentFigure("S1 Table 3.1", "90 % of the shaft's power leave the pump, at an "
                           "unstated pressure", "one point, at 160 bar"),
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the efficiencies and the torque against pressure."""
    shares, shaft = figure.subplots(1, 2)
    for name, colour in (("volumetric", SKY), ("mechanical", VERMILION), ("overall", BLUE)):
        shares.plot(result["pressure"], result[f"{name} efficiency"], ".-", color=colour,
                    label=name)  # fmt: skip
    if result.figures:
        shares.plot(DOCUMENT_PRESSURE * 1e-5, DOCUMENT_OVERALL * 100.0, "s", color=BLACK,
                    label="S1 Table 3.1")  # fmt: skip
    shares.set_ylim(65.0, 101.0)
    look.label(shares, "pressure [bar]", "efficiency [%]", "Variable displacement, full stroke")
    look.legend(shares)
    shaft.plot(result["pressure"], result["torque"], ".-", color=BLUE)
    shaft.set_xlim(left=0.0)
    shaft.set_ylim(bottom=0.0)
    look.label(shaft, "pressure [bar]", "torque [N m]", "At the shaft")


TEST = Procedure("pump-torque", "Torque and efficiencies of the pump", run, draw, Chapter.PUMP, 2)
