"""Discharge coefficient of the metering edges against the Reynolds number (S1 3.3.2, S2 Fig. 1).

Ports a and b are joined through a flow meter, so both edges are equal orifices in series. The
supply pressure is swept with the spool held; C_d follows from flow and drop of one edge, relative
to the turbulent value 0.6 that the valve gain implies:

    C_d = 0.6 q/(K_v u sqrt(dp)),    Re = D_h v/nu,    D_h = 2 x,    v = C_d sqrt(2 dp/rho)

with the slot x of the edge. Towards Re = 0 the flow is laminar, C_d ~ sqrt(Re); for a sharp edge
this is creeping flow through a slit, q = pi x² w dp/(32 mu) (Wuest 1954, in Merritt 1967).
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.edges import Edges
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, SKY, VERMILION

TURBULENT = 0.6
"""Discharge coefficient C_d (S1 3.3.2)."""
_TANK = 10e5  # pressure after the valve [Pa]
_DROPS = np.geomspace(0.05e5, 100e5, 45)  # of one edge [Pa]
_OPENINGS = (0.02, 0.1, 1.0)  # parts of the full opening
_KEPT = (
    "gain_asymmetry", "overlap", "underlap", "land_leakage", "flow_saturation", "gain_sa",
    "gain_at", "gain_sb", "gain_bt", "lap_sa", "lap_at", "lap_sb", "lap_bt",
    "viscosity_temperature",
)  # fmt: skip
_SECONDS = 0.05  # enough for the spool; joined ports start at their steady pressure


def _flow(bench: Bench, current: float, drop: float) -> tuple[float, float]:
    """Return drop [Pa] and flow [m³/s] of one edge."""
    ideal = bench.off("supply", "tank", "valve", "oil", keep=_KEPT)
    pressures = {"supply_pressure": _TANK + 2.0 * drop, "tank_pressure": _TANK}
    changes = ideal | bench.joined() | bench.sealed() | pressures
    stand = bench.stand(changes)
    stand.plant.state.pressure_a = stand.plant.state.pressure_b = _TANK + drop
    stand.plant.state.spool_position = current
    signals = stand.drive(np.full(round(_SECONDS / stand.period), current)).signals
    edge = signals["supply_pressure"] - signals["pressure_a"]
    return float(edge[-1]), float(signals["flow_a"][-1])


def _opening(bench: Bench, part: float) -> float:
    """Return the opening of the edge from s to a [A] at a fraction of its full opening."""
    edges = Edges.of(bench)
    return edges.opening(edges.beyond(part))


def coefficient(bench: Bench, opening: float, drop: float) -> float:
    """Return C_d of the configured edge at an opening [A] and a drop [Pa].

    It is at most 0.6; below the critical Reynolds number C_d = 0.6 sqrt(Re/Re_c).
    """
    speed = TURBULENT * math.sqrt(2.0 * drop / bench.value("oil_density"))
    diameter = 2.0 * bench.value("valve_slot_per_ampere") * opening
    turbulent = diameter * speed / bench.viscosity
    laminar = bench.value("valve_critical_reynolds_number") / turbulent
    # for the integration an edge of any width is laminar below a pressure drop
    least = bench.value("valve_laminar_width") / drop
    return TURBULENT * float((1.0 + laminar**4 + least**2) ** -0.25)


def _at(drop: float, drops: Series, coefficients: Series) -> float:
    return float(np.interp(math.log(drop), np.log(drops), coefficients))


def _comparisons(bench: Bench, curves: dict[float, tuple[Series, Series]]) -> list[Comparison]:
    """Compare at 70 bar and at 1 bar; `curves` holds drop [Pa] and C_d by opening."""
    rows = [Comparison("turbulent discharge coefficient, full opening, 70 bar", "1", TURBULENT,
                       "S1 3.3.2, by definition of K_v",
                       _at(70e5, *curves[1.0]), 0.01, Agreement.CONFIGURED)]  # fmt: skip
    for part in _OPENINGS:
        at, opening = 1e5, _opening(bench, part)
        rows.append(Comparison(
            f"C_d at {part:.0%} opening and 1 bar", "1", coefficient(bench, opening, at),
            "C_d(Re) and laminar width as configured", _at(at, *curves[part]), 0.01,
            Agreement.CONFIGURED,
        ))  # fmt: skip
    opening = _opening(bench, _OPENINGS[0])
    slot = bench.value("valve_slot_per_ampere") * opening
    # pi x² w dp/(32 mu) over x w sqrt(2 dp/rho)
    viscosity = bench.viscosity * bench.value("oil_density")
    creeping = (
        math.pi * slot / (32.0 * viscosity) * math.sqrt(0.5 * 1e4 * bench.value("oil_density"))
    )
    rows.append(Comparison(
        "C_d at 2% opening and 0.1 bar", "1", creeping, "creeping flow through a slit (Wuest)",
        _at(1e4, *curves[_OPENINGS[0]]), 0.02, Agreement.DERIVED,
    ))  # fmt: skip
    return rows


def run(bench: Bench) -> BenchResult:
    """Sweep the drop at several openings."""
    slot = bench.value("valve_slot_per_ampere")
    density = bench.value("oil_density")
    rows, curves = [], {}
    for part in _OPENINGS:
        opening, travel = _opening(bench, part), Edges.of(bench).beyond(part)
        points = np.array([_flow(bench, travel, drop) for drop in _DROPS])
        edge, flow = points.T
        c_d = TURBULENT * flow / (bench.value("valve_gain") * opening * np.sqrt(edge))
        speed = c_d * np.sqrt(2.0 * edge / density)
        reynolds = 2.0 * slot * opening * speed / bench.viscosity
        curves[part] = (edge, c_d)
        rows.append([np.full_like(edge, part * 100.0), edge * 1e-5, reynolds, c_d])
    part, edge, reynolds, c_d = np.concatenate(rows, axis=1)
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
            "C_d": column("1", c_d),
        },
        comparisons=_comparisons(bench, curves),
        again=lambda other: _comparisons(other, curves),
        notes=["C_d is 0.6 by definition of the valve gain; the test shows where it decreases."],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw C_d against the Reynolds number."""
    axes = figure.add_subplot()
    for part, colour in zip(_OPENINGS, (SKY, VERMILION, BLUE), strict=True):
        reynolds, c_d = (
            result.where("opening", part * 100.0, name) for name in ("Reynolds number", "C_d")
        )
        axes.semilogx(reynolds, c_d, ".-", color=colour, label=f"{part:.0%} opening")
    axes.axhline(TURBULENT, color=BLACK, linewidth=0.8, linestyle=":")
    axes.set_ylim(bottom=0)
    look.label(axes, "Reynolds number", "discharge coefficient", "One metering edge")
    look.legend(axes)


TEST = Procedure(
    "discharge", "Discharge coefficient against Reynolds number", run, draw, Chapter.OIL, 1
)
