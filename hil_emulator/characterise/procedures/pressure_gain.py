"""Pressure sensitivity of the valve: blocked ports, slow sine (S1 3.5.1).

With an opening u_0 of all edges at null, by underlap, a blocked port sits at

    p = p_t + (p_s - p_t) (u_0 + u)² / ((u_0 + u)² + (u_0 - u)²),

whose slope at null is K_p = (p_s - p_t)/u_0: for laminar as for turbulent flow, as both depend on
the product of opening and root of the drop alone. Leaking lands have the same slope there. Both
sweeps of the sine together cancel the lag of the 10 ms that the ports need; what is left between
them is hysteresis of the valve.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
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
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

DOCUMENT_SENSITIVITY = 5.7e11
"""K_pa, about the magnitude of K_pb [Pa/A] (S1 3.5.1)."""
_SWEEP = 20.0  # period of the sine [s]
_WIDE = 0.05  # amplitude of the sweep that looks for the null, part of the rated current
_NARROW = 3.0  # amplitude of the sweep around null, in openings at null
_NEAR_NULL = 0.3  # part of that opening over which the slope is fitted
_PLUGS = {"cylinder_dead_volume_a": 2e-7, "cylinder_dead_volume_b": 2e-7}
"""What is left behind ports that are plugged [m³]: so little that creeping oil fills it in time."""
_SMOOTHED = 51  # readings averaged before the null is read off
_LOOP_NOTE = (
    "Hysteresis and threshold move the curve by up to {:.3g} uA: its slope is not the lap's alone."
)
_KEPT = slice(None, None, 10)  # of the readings, in the table


def _sweep(bench: Bench, centre: float, amplitude: float) -> tuple[Series, Series, Series]:
    """Return current [A] and the readings of both pressures [Pa] over one period."""
    stand = bench.stand(bench.off("supply", "tank") | bench.blocked() | _PLUGS)
    time = np.arange(0.0, 1.25 * _SWEEP, stand.period)
    current = centre + amplitude * np.sin(2.0 * math.pi * time / _SWEEP)
    seen = stand.drive(current).readings
    whole = slice(round(0.25 * _SWEEP / stand.period), None)
    return current[whole], seen["pressure_a"][whole], seen["pressure_b"][whole]


def _slope(current: Series, pressure: Series, centre: float, width: float) -> float:
    """Return the slope at `centre` of a curve through the points around it [Pa/A].

    A cubic, bent another way on either side: an edge that closes is not one that opens.
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


def find_null(bench: Bench) -> float:
    """Return the current at which both blocked ports hold the same pressure [A]."""
    current, p_a, p_b = _sweep(bench, 0.0, _WIDE * bench.rated_current)
    return _crossing(current, p_a - p_b)


def _loop(bench: Bench) -> float:
    """Return by how much the curves of both directions may lie apart [A]."""
    return bench.value("hysteresis_width") + 2.0 * bench.value("threshold_current")


def _comparisons(bench: Bench, k_pa: float, k_pb: float) -> list[Comparison]:
    rows = [
        Comparison("pressure sensitivity K_pa at 160 bar", "Pa/A", DOCUMENT_SENSITIVITY,
                   "S1 3.5.1", k_pa, 0.05, Agreement.DOCUMENT),
    ]  # fmt: skip
    lap = bench.null_opening
    if lap and _loop(bench) <= _NEAR_NULL * _NEAR_NULL * lap:
        slope = (bench.value("supply_pressure") - bench.value("tank_pressure")) / lap
        source = "(p_s - p_t)/u_0, configured"
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
    lap = bench.null_opening
    width = lap or 1e-3 * bench.rated_current
    current, p_a, p_b = _sweep(bench, find_null(bench), _NARROW * width)
    null = _crossing(current, p_a - p_b)
    k_pa, k_pb = (_slope(current, p, null, _NEAR_NULL * width) for p in (p_a, p_b))
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            f"Both ports blocked, the current on a sine of {1 / _SWEEP:.2f} Hz around null. "
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
        + ([] if lap else ["Edges closed at null: the sensitivity has no finite value."])
        + ([_LOOP_NOTE.format(_loop(bench) * 1e6)] if _loop(bench) else []),
        figures=[
            DocumentFigure("S1 3.5.1", "K_pa and K_pb about 5.7e11 Pa/A, their signs aside",
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
