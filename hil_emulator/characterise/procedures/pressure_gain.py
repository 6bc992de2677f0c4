"""Pressure sensitivity of the valve: blocked ports, slow sine (S1 3.5.1).

With openings a(u) and a(-u) of its two edges the pressure of a blocked port is

    p = p_t + (p_s - p_t) a(u)² / (a(u)² + a(-u)²),

whose slope at null is K_p = (p_s - p_t) a'(0)/a(0), for laminar and turbulent flow: both depend
only on the product of the opening and the root of the drop. a(0)/a'(0) is the opening at null for
an underlap, and the clearance for leaking lands, plus twice the overlap if there is one. The rising
and the falling sweep of the sine together cancel the lag of the ports, 10 ms. If hysteresis or
threshold separate the sweeps, a ramp goes through each null instead. It starts so far away that the
spool is on one side of its loop; the result is the mean of both slopes.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.edges import Edges, loop, loop_reach
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import (
    Agreement,
    BenchResult,
    Column,
    Comparison,
    DocumentFigure,
    Series,
    column,
)
from hil_emulator.characterise.stand import Bench, Stand
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

DOCUMENT_SENSITIVITY = 5.7e11
"""K_pa, and approximately the magnitude of K_pb [Pa/A] (S1 3.5.1)."""
_SWEEP = 20.0  # period of the sine, and twice the time of a ramp [s]
_BEHIND, _WAITS = 1.0, 4.0  # approach to a ramp's start, and time for tight lands to fill ports [s]
_WIDE = 0.05  # amplitude of the sweep that searches the null, part of the rated current
_NEAR_NULL = 0.3  # part of the width of the null over which the slope is fitted
_PLUG = 2e-7
"""Volume at plugged ports of a valve of the reference's size [m³], small enough for leakage to fill
it in time."""
_SMOOTHED = 51  # readings averaged before the null is determined
_LOOP_NOTE = "Hysteresis and threshold separate the two sweeps by up to {:.3g} uA."
_TIGHT = "pressure sensitivity: infinite for edges closed at null; give land_leakage."
_KEPT = slice(None, None, 10)  # of the readings, in the table


def _blocked(bench: Bench) -> Stand:
    """Return the valve with plugged ports."""
    plug = _PLUG * max(1.0, bench.valve_size)
    plugs = {"cylinder_dead_volume_a": plug, "cylinder_dead_volume_b": plug}
    return bench.stand(bench.off("supply", "tank") | bench.blocked() | plugs)


def _sweep(bench: Bench, centre: float, amplitude: float) -> tuple[Series, Series, Series]:
    """Return current [A] and the readings of both pressures [Pa] over one period."""
    stand = _blocked(bench)
    time = np.arange(0.0, 1.25 * _SWEEP, stand.period)
    current = centre + amplitude * np.sin(2.0 * math.pi * time / _SWEEP)
    readings = stand.drive(current).readings
    whole = slice(round(0.25 * _SWEEP / stand.period), None)
    return current[whole], readings["pressure_a"][whole], readings["pressure_b"][whole]


def _slope(current: Series, pressure: Series, centre: float, width: float) -> float:
    """Return the slope at `centre` of a curve fitted to the points around it [Pa/A].

    The curve is a cubic with different curvature on each side, as one edge opens and one closes.
    """
    near = np.abs(current - centre) < width
    t = (current[near] - centre) / width
    basis = np.column_stack([t, t * np.abs(t), t**3, np.ones_like(t), t * t])
    return float(np.linalg.lstsq(basis, pressure[near], rcond=None)[0][0] / width)


def _crossing(current: Series, difference: Series) -> float:
    """Return the current [A] at which a noisy pressure difference changes sign."""
    order = np.argsort(current)
    smooth = np.convolve(difference[order], np.ones(_SMOOTHED) / _SMOOTHED, mode="valid")
    half = _SMOOTHED // 2
    return float(np.interp(0.0, smooth, current[order][half:-half]))


def _nulls(bench: Bench) -> list[float]:
    """Return the nulls of the rising and the falling current; a single one if they agree [A]."""
    wide = _WIDE * bench.rated_current + loop_reach(bench)
    current, p_a, p_b = _sweep(bench, 0.0, wide)
    rising = np.gradient(current) > 0.0
    sides = (rising, ~rising) if loop(bench) else (np.ones_like(rising),)
    return [_crossing(current[side], (p_a - p_b)[side]) for side in sides]


def find_null(bench: Bench) -> float:
    """Return the current at which both blocked ports hold the same pressure [A]."""
    return float(np.mean(_nulls(bench)))


def _ramp(bench: Bench, centre: float, by: float, reach: float) -> tuple[Series, Series, Series]:
    """Return the same as `_sweep` for a ramp from centre - by to centre + by.

    The approach is so long that the spool is on one side of its loop, and has no step, after which
    the spool would overshoot and stick.
    """
    stand = _blocked(bench)
    count = round(0.5 * _SWEEP / stand.period)
    start = centre - by
    from_far = np.linspace(start - math.copysign(reach, by), start, round(_BEHIND / stand.period))
    waiting = np.full(round(_WAITS / stand.period), start)
    current = np.concatenate([from_far, waiting, np.linspace(start, centre + by, count)])
    readings = stand.drive(current).readings
    ramp = slice(-count, None)
    return current[ramp], readings["pressure_a"][ramp], readings["pressure_b"][ramp]


def _sweeps(bench: Bench, amplitude: float) -> list[tuple[Series, Series, Series]]:
    """Return a sweep about null, or one for each side of the spool's loop."""
    nulls = _nulls(bench)
    if len(nulls) == 1:
        return [_sweep(bench, nulls[0], amplitude)]
    sides = zip((amplitude, -amplitude), nulls, strict=True)
    return [_ramp(bench, null, by, loop_reach(bench)) for by, null in sides]


def _comparisons(bench: Bench, k_pa: float, k_pb: float) -> list[Comparison]:
    rows = [
        Comparison("pressure sensitivity K_pa at 160 bar", "Pa/A", DOCUMENT_SENSITIVITY,
                   "S1 3.5.1", k_pa, 0.05, Agreement.DOCUMENT),
    ]  # fmt: skip
    width = Edges.of(bench).null_width
    if width:
        slope = (bench.value("supply_pressure") - bench.value("tank_pressure")) / width
        source = "(p_s - p_t) a'(0)/a(0), configured"
        rows += [
            Comparison(
                "pressure sensitivity K_pa", "Pa/A", slope, source, k_pa, 0.02, Agreement.DERIVED
            ),
            Comparison(
                "pressure sensitivity K_pb", "Pa/A", -slope, source, k_pb, 0.02, Agreement.DERIVED
            ),
        ]
    return rows


def _document_lines(bench: Bench, current: Series) -> dict[str, Column]:
    """Return straight lines of the document's slope between tank and supply pressure."""
    low, high = bench.value("tank_pressure"), bench.value("supply_pressure")
    lines = {"pressure a": DOCUMENT_SENSITIVITY, "pressure b": -DOCUMENT_SENSITIVITY}
    pressures = {name: 0.5 * (low + high) + slope * current for name, slope in lines.items()}
    return {
        f"{name}, S1 3.5.1": column("bar", np.where((p > low) & (p < high), p, np.nan) * 1e-5)
        for name, p in pressures.items()
    }


def run(bench: Bench) -> BenchResult:
    """Measure both port pressures around null with the pressure sensors."""
    tight = Edges.of(bench).null_width == 0.0
    width = Edges.of(bench).null_width or 1e-3 * bench.rated_current
    sweeps = _sweeps(bench, Edges.of(bench).about_null or 3.0 * width)
    nulls = [_crossing(u, a - b) for u, a, b in sweeps]
    null = float(np.mean(nulls))
    k_pa, k_pb = (
        float(np.mean([_slope(s[0], s[i], n, _NEAR_NULL * width)
                       for s, n in zip(sweeps, nulls, strict=True)]))
        for i in (1, 2)
    )  # fmt: skip
    current, p_a, p_b = (np.concatenate(series) for series in zip(*sweeps, strict=True))
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            f"Both ports blocked, the current on a sine of {1 / _SWEEP:.2f} Hz around null, or on "
            "a ramp through each null of a valve with hysteresis or threshold. "
            "The slope is that of a smooth curve through the readings of both sweeps at null."
        ),
        columns={
            "current": column("uA", current[_KEPT] * 1e6),
            "pressure a": column("bar", p_a[_KEPT] * 1e-5),
            "pressure b": column("bar", p_b[_KEPT] * 1e-5),
        }
        | _document_lines(bench, current[_KEPT] - null),
        comparisons=_comparisons(bench, k_pa, k_pb),
        notes=[f"Null of this valve: {null * 1e6:+.1f} uA."]
        + ([_LOOP_NOTE.format(loop(bench) * 1e6)] if loop(bench) else []),
        inapplicable=[_TIGHT] if tight else [],
        figures=[
            DocumentFigure("S1 3.5.1", "magnitude of K_pa and K_pb about 5.7e11 Pa/A",
                           "two straight lines of that slope through half the pressure at null"),
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw both port pressures against the current."""
    axes = figure.add_subplot()
    for name, colour in (("pressure a", BLUE), ("pressure b", VERMILION)):
        axes.plot(result["current"], result[name], ".", markersize=2, color=colour)
        axes.plot([], [], color=colour, label=name)
    if result.figures:
        for name in ("pressure a", "pressure b"):
            axes.plot(result["current"], result[f"{name}, S1 3.5.1"], "--", color=BLACK,
                      linewidth=1)  # fmt: skip
        axes.plot([], [], "--", color=BLACK, linewidth=1, label="slopes of S1 3.5.1")
    look.label(axes, "current [uA]", "pressure [bar]", "Pressure sensitivity, blocked ports")
    look.legend(axes)


TEST = Procedure(
    "pressure-gain", "Pressure sensitivity with blocked ports", run, draw, Chapter.VALVE, 2
)
