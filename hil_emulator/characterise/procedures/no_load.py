"""Chamber pressures of a free rod in both directions, and its speed (S1 eq. 3.9-3.12).

Without load p_a = alpha p_b. With q_b = alpha q_a and turbulent flow the drops at the two edges
differ by alpha². So the pressures follow from the areas alone, and jump at a change of direction.
With p_t = 0 they are alpha³ and alpha² over 1 + alpha³ of the supply pressure in extension, alpha
and 1 over 1 + alpha³ in retraction.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.edges import Edges, loop
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.pressure_gain import find_null
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import Bench, BenchRecord
from hil_emulator.pages.palette import BLUE, VERMILION

_PART = 0.1  # of the full opening
_TRAVEL = 0.6  # part of the stroke
_SETTLED = 0.4  # part of the record for settling, left out
_FREE_MASS = 1.0  # of rod and piston without a load, rounded up [kg] (assumed)


def expected_pressures(
    alpha: float, supply: float, tank: float, extends: bool, unlike: float = 1.0
) -> tuple[float, float]:
    """Return p_a and p_b of a free rod [Pa].

    Args:
        alpha: annulus over piston area.
        supply: pressure [Pa].
        tank: pressure [Pa].
        extends: whether the rod extends.
        unlike: opening of the edge at port a over that at port b.

    """
    source, sink = (supply, tank) if extends else (tank, supply)
    drops = (alpha * unlike) ** 2
    p_a = alpha * (drops * source + sink) / (1.0 + alpha * drops)
    return p_a, p_a / alpha


def _unlike(bench: Bench, sign: float) -> float:
    """Return the opening of the edge at port a over that at port b in a direction."""
    edges = Edges.of(bench)
    pair = ("sa", "bt") if sign > 0.0 else ("at", "sb")
    at_a, at_b = (edges.opening(sign * edges.beyond(_PART), edge) for edge in pair)
    return at_a / at_b


def _move(bench: Bench, sign: float, null: float) -> BenchRecord:
    """Extend or retract the free rod at constant current over most of the stroke."""
    stroke, drop = bench.value("cylinder_stroke"), bench.value("supply_pressure")
    edges = Edges.of(bench)
    opening = _PART * (edges.rated - edges.overlap)
    current = edges.beyond(_PART) + 0.5 * loop(bench)
    speed = (
        bench.value("valve_gain") * opening * math.sqrt(drop) / bench.value("cylinder_piston_area")
    )
    ideal = bench.off("supply", "tank", "friction", "load", "cylinder")
    free = (
        ideal
        | bench.sealed()
        | {
            "load_mass": _FREE_MASS,
            # without it a small valve's edges are partly laminar: C_d < 0.6 at the smaller drop
            "valve_critical_reynolds_number": 0.0,
            "initial_position": 0.5 * stroke * (1.0 - sign * _TRAVEL),
        }
    )
    stand = bench.stand(free)
    return stand.drive(
        np.full(round(_TRAVEL * stroke / speed / stand.period), null + sign * current)
    )


def run(bench: Bench) -> BenchResult:
    """Move the free rod in both directions and read the pressure sensors."""
    alpha, supply, tank = (
        bench.value(f) for f in ("cylinder_area_ratio", "supply_pressure", "tank_pressure")
    )  # fmt: skip
    null, parts, comparisons = find_null(bench), [], []
    for sign, name in ((1.0, "extension"), (-1.0, "retraction")):
        record = _move(bench, sign, null)
        late = record.after(_SETTLED * record.time[-1]).readings
        wanted = expected_pressures(alpha, supply, tank, sign > 0.0, _unlike(bench, sign))
        for channel, value in zip(("pressure_a", "pressure_b"), wanted, strict=True):
            comparisons.append(Comparison(
                f"p_{channel[-1]} in free {name}", "bar", value * 1e-5,
                "areas and supply pressure alone (S1 eq. 3.9-3.12)",
                float(np.mean(late[channel])) * 1e-5, 5e-3, Agreement.DERIVED,
            ))  # fmt: skip
        parts.append(_rows(record, sign))
    table = np.concatenate(parts, axis=1)
    names = (("direction", ""), ("time", "s"), ("pressure a", "bar"), ("pressure b", "bar"),
             ("position", "mm"))  # fmt: skip
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Load, friction and laminar flow switched off, 10 % of the full opening in each "
            "direction; mean of the pressure sensors after the start has settled."
        ),
        columns={n: column(unit, v) for (n, unit), v in zip(names, table, strict=True)},
        comparisons=comparisons,
    )


def _rows(record: BenchRecord, sign: float) -> Series:
    read = record.readings
    return np.array([
        np.full_like(record.time, sign), record.time, read["pressure_a"] * 1e-5,
        read["pressure_b"] * 1e-5, read["position"] * 1e3,
    ])  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw both pressures in both directions."""
    for axes, sign, name in zip(
        figure.subplots(1, 2, sharey=True), (1.0, -1.0), ("Extension", "Retraction"), strict=True
    ):
        for channel, colour in (("pressure a", BLUE), ("pressure b", VERMILION)):
            time, pressure = (result.where("direction", sign, n) for n in ("time", channel))
            axes.plot(time, pressure, color=colour, linewidth=1, label=channel)
        look.label(axes, "time [s]", "pressure [bar]" if sign > 0.0 else "", name)
    axes.set_ylim(bottom=0)  # shared by both axes
    look.legend(axes)


TEST = Procedure("no-load", "Pressures of a free rod", run, draw, Chapter.CYLINDER, 1)
