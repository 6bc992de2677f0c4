"""Discharge coefficient of the metering edges against the Reynolds number (S1 3.3.2, S2 eq. 5).

Ports a and b are joined through a flow meter, so both edges are equal orifices in series. At a
held spool the supply pressure is swept; C_d follows from flow and drop of one edge, relative to
the turbulent 0.6 that the valve gain stands for:

    C_d = 0.6 q/(K_v u sqrt(dp)),    Re = D_h v/nu,    D_h = 2 x,    v = C_d sqrt(2 dp/rho)

with the slot x of the edge. Towards Re = 0 an orifice becomes laminar.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, SKY, VERMILION

TURBULENT = 0.6
"""Discharge coefficient C_d (S1 3.3.2)."""
_TANK = 10e5  # pressure after the valve [Pa]
_DROPS = np.geomspace(0.05e5, 100e5, 45)  # of one edge [Pa]
_OPENINGS = (0.02, 0.1, 1.0)  # parts of the rated current
_KEPT = (
    "gain_asymmetry", "overlap", "underlap", "flow_saturation", "reynolds_discharge",
    "viscosity_temperature",
)  # fmt: skip
_SECONDS = 0.05  # a spool and joined ports at their steady pressure need no longer


def _flow(bench: Bench, current: float, drop: float) -> tuple[float, float]:
    """Return drop [Pa] and flow [m³/s] of one edge."""
    ideal = bench.off("supply", "tank", "valve", "oil", keep=_KEPT)
    pressures = {"supply_pressure": _TANK + 2.0 * drop, "tank_pressure": _TANK}
    changes = ideal | bench.joined() | pressures
    stand = bench.stand(changes)
    stand.plant.state.pressure_a = stand.plant.state.pressure_b = _TANK + drop
    stand.plant.state.spool_position = current
    signals = stand.drive(np.full(round(_SECONDS / stand.period), current)).signals
    edge = signals["supply_pressure"] - signals["pressure_a"]
    return float(edge[-1]), float(signals["flow_a"][-1])


def expected(bench: Bench, part: float, drop: float) -> float:
    """Return C_d of the configured edge: laminar below its width, HyLib's law where that is on."""
    width = bench.value("valve_laminar_width") * bench.relative_viscosity**2
    coefficient: float = TURBULENT * (1.0 + (width / drop) ** 2) ** -0.25
    critical = bench.value("reynolds_discharge_critical_flow_number")
    if critical:
        opening = part * bench.rated_current + bench.value("underlap_lap")
        diameter = 2.0 * bench.value("reynolds_discharge_slot_per_ampere") * opening
        speed = math.sqrt(2.0 * drop / bench.value("oil_density"))
        coefficient *= math.tanh(2.0 * diameter * speed / bench.viscosity / critical)
    return coefficient


def _at(drop: float, drops: Series, coefficients: Series) -> float:
    return float(np.interp(math.log(drop), np.log(drops), coefficients))


def _comparisons(bench: Bench, seen: dict[float, tuple[Series, Series]]) -> list[Comparison]:
    """Compare at 70 bar and at 1 bar; `seen` holds drop [Pa] and C_d by opening."""
    rows = [Comparison("turbulent discharge coefficient, full opening, 70 bar", "1", TURBULENT,
                       "S1 3.3.2, by definition of K_v",
                       _at(70e5, *seen[1.0]), 0.01, Agreement.CONFIGURED)]  # fmt: skip
    for part in _OPENINGS:
        at = 1e5
        rows.append(Comparison(
            f"C_d at {part:.0%} opening and 1 bar", "1", expected(bench, part, at),
            "laminar width and C_d(Re) as configured", _at(at, *seen[part]), 0.01,
            Agreement.CONFIGURED,
        ))  # fmt: skip
    return rows


def run(bench: Bench) -> BenchResult:
    """Sweep the drop at several openings."""
    slot = bench.value("reynolds_discharge_slot_per_ampere")
    density, lap = bench.value("oil_density"), bench.value("underlap_lap")
    rows, seen = [], {}
    for part in _OPENINGS:
        current = part * bench.rated_current
        opening = current + lap
        points = np.array([_flow(bench, current, drop) for drop in _DROPS])
        edge, flow = points.T
        coefficient = TURBULENT * flow / (bench.value("valve_gain") * opening * np.sqrt(edge))
        speed = coefficient * np.sqrt(2.0 * edge / density)
        reynolds = 2.0 * slot * opening * speed / bench.viscosity
        seen[part] = (edge, coefficient)
        rows.append([np.full_like(edge, part * 100.0), edge * 1e-5, reynolds, coefficient])
    part, edge, reynolds, coefficient = np.concatenate(rows, axis=1)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Ports a and b joined through a flow meter, the spool held at three openings, the drop "
            "of one edge from 0.05 to 100 bar."
        ),
        columns={
            "opening": column("%", part),
            "drop": column("bar", edge),
            "Reynolds number": column("1", reynolds),
            "C_d": column("1", coefficient),
        },
        comparisons=_comparisons(bench, seen),
        notes=["C_d is 0.6 by definition of the valve gain; the test shows where it falls."],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw C_d against the Reynolds number."""
    axes = figure.add_subplot()
    for part, colour in zip(_OPENINGS, (SKY, VERMILION, BLUE), strict=True):
        reynolds, coefficient = (
            result.where("opening", part * 100.0, name) for name in ("Reynolds number", "C_d")
        )
        axes.semilogx(reynolds, coefficient, ".-", color=colour, label=f"{part:.0%} opening")
    axes.axhline(TURBULENT, color=BLACK, linewidth=0.8, linestyle=":")
    axes.set_ylim(bottom=0)
    look.label(axes, "Reynolds number", "discharge coefficient", "One metering edge")
    look.legend(axes)


TEST = Procedure(
    "discharge", "Discharge coefficient against Reynolds number", run, draw, Chapter.OIL, 1
)
