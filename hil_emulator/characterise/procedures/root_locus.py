"""Root locus of force feedback over its gain (S1 Fig. 3.14).

The current u = -k f, or -k f_h, at rest at mid-stroke. With increasing gain one pole of each loop
tends to the zero of its force, which S1 states as -10 and -30 rad/s. The poles of the exact
linearisation, with the effects of S1's linear model, are compared with the roots of

    1 + k F(s) = 0

with the complete form of S1 eq. 3.38 and 3.40.
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.procedures.force_poles import Poles, rest_point, s1_values
from hil_emulator.characterise.procedures.force_zeros import DOCUMENT_ZEROS
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
from hil_emulator.model import linear, linearise
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION

_FORCES = {"f": "load_force", "f_h": "hydraulic_force"}
_ZEROS = dict(zip(_FORCES, DOCUMENT_ZEROS, strict=True))
_GAINS = np.geomspace(1e-10, 1e-4, 181)  # [A/N]
_COMPARED = slice(None, None, 30)  # of the gains
_OMEGA = np.geomspace(1.0, 1e5, 20001)  # [rad/s]


def roots(above: Series, below: Series, gains: Series) -> Poles:
    """Return the roots of 1 + k above(s)/below(s), falling powers; shape (gains, poles) [rad/s]."""
    return np.array([np.roots(np.polyadd(below, k * above)) for k in gains])


def gain_margin(above: Series, below: Series) -> float:
    """Return the gain at the stability limit [A/N], by the Nyquist criterion."""
    response = np.polyval(above, 1j * _OMEGA) / np.polyval(below, 1j * _OMEGA)
    crosses = np.flatnonzero(np.diff(np.sign(response.imag)) != 0)
    return float(1.0 / np.max(-response.real[crosses]))


def largest_stable(gains: Series, poles: Poles) -> float:
    """Return the gain at which the first pole crosses the imaginary axis [A/N]."""
    furthest = poles.real.max(axis=1)
    first = int(np.argmax(furthest > 0.0))
    part = furthest[first - 1] / (furthest[first - 1] - furthest[first])
    return float(gains[first - 1] * (gains[first] / gains[first - 1]) ** part)


def _moving(poles: Poles) -> Poles:
    """Leave out the pole of the position at the origin, which force feedback does not move."""
    order = np.argsort(np.abs(poles), axis=1)[:, 1:]
    return np.take_along_axis(poles, order, axis=1)


def _distance(poles: Poles, expected: Poles) -> float:
    """Return the largest relative distance of an expected pole from the nearest pole."""
    apart = np.abs(poles[:, :, None] - expected[:, None, :]).min(axis=1) / np.abs(expected)
    return float(apart.max())


def _comparisons(
    force: str, exact: Poles, stable: float, above: Series, below: Series
) -> list[Comparison]:
    worst = _distance(exact[_COMPARED], roots(above, below, _GAINS[_COMPARED]))
    source = "S1 eq. 3.11-3.26, complete form"
    return [
        Comparison(f"largest stable gain, feedback of {force}", "uA/N",
                   gain_margin(above, below) * 1e6, f"{source}; Nyquist",
                   stable * 1e6, 0.02, Agreement.DERIVED),
        Comparison(f"exact over analytic pole, feedback of {force}, worst of 7 gains", "1", 1.0,
                   source, 1.0 + worst, 0.01, Agreement.DERIVED),
    ]  # fmt: skip


def _columns(force: str, exact: Poles) -> Mapping[str, Column]:
    return {
        f"{part} {i}, {force}": column("rad/s", getattr(poles, part))
        for i, poles in enumerate(exact.T)
        for part in ("real", "imag")
    }


def run(bench: Bench) -> BenchResult:
    """Close the loop over both forces at rest at mid-stroke."""
    values = s1_values(bench)
    machine = linear.LinearisedMachine.of(values)
    rest = linearise.rest(bench.kernel, values, 0.5 * machine.stroke)
    analytic = linear.complete(machine, rest_point(rest))
    columns, comparisons = {"gain": column("uA/N", _GAINS * 1e6)}, []
    for force, name in _FORCES.items():
        exact = _moving(rest.closed_loop_poles("valve_current", name, _GAINS))
        # finer gains around the stability limit, because a pole may turn sharply between two gains
        fine = largest_stable(_GAINS, exact) * np.geomspace(0.9, 1.1, 101)
        closer = _moving(rest.closed_loop_poles("valve_current", name, fine))
        columns |= _columns(force, exact)
        transfer = getattr(analytic, name)
        stable = largest_stable(fine, closer)
        comparisons += _comparisons(force, exact, stable, transfer.num, transfer.den)
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Load force or hydraulic force fed back to the current, exact linearisation at rest at "
            "mid-stroke with the effects that S1's linear model has, at 181 gains."
        ),
        columns=columns,
        comparisons=comparisons,
        again=lambda other: run(other).comparisons,
        figures=[
            DocumentFigure(
                "S1 Fig. 3.14", "zeros of f and f_h at about -10 and -30 rad/s, without gains",
                "both zeros; the branches are those of the machine",
            )
        ],
    )  # fmt: skip


def _poles(result: BenchResult, force: str) -> Poles:
    """Return the poles at each gain from the table, shape (gains, poles) [rad/s]."""
    indices = range(sum(name.endswith(f", {force}") for name in result.columns) // 2)
    parts = [[result[f"{part} {i}, {force}"] for i in indices] for part in ("real", "imag")]
    return np.asarray(np.array(parts[0]) + 1j * np.array(parts[1])).T


def _locus(plane: Axes, near: Axes, poles: Poles, gains: Series) -> None:
    """Draw the upper half plane, and the real poles near the origin against the gain."""
    plane.plot(poles.real, poles.imag, ".", markersize=3, color=BLUE)
    plane.plot(poles[0].real, poles[0].imag, "x", color=VERMILION)
    plane.axvline(0.0, color=BLACK, linewidth=0.8, linestyle=":")
    fastest = float(np.abs(poles[0]).max())
    plane.set_xlim(-1.3 * fastest, 0.5 * fastest)
    plane.set_ylim(-0.03 * fastest, 1.6 * fastest)
    look.label(plane, "real part [rad/s]", "imaginary [rad/s]")
    real = np.where(np.abs(poles.imag) < 1e-6 * np.abs(poles), poles.real, np.nan)
    near.semilogy(real, gains, ".", markersize=3, color=BLUE)
    near.plot([], [], ".", color=BLUE, label="real poles")
    # the slowest of the real poles tends to the zero
    slow = -real[-1][np.isfinite(real[-1]) & (real[-1] < 0.0)]
    near.set_xlim(-2.0 * float(slow.min(initial=np.inf)) if slow.size else -60.0, 0.0)
    look.label(near, "real part [rad/s]", "gain [uA/N]")


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw both loci, and below them the real pole that tends to the zero."""
    grid = figure.subplots(2, 2)
    for (plane, near), force in zip(grid.T, _FORCES, strict=True):
        _locus(plane, near, _poles(result, force), result["gain"])
        plane.set_title(f"Feedback of {force}", fontsize="medium", loc="left")
        if result.figures:
            near.axvline(_ZEROS[force], color=BLACK, linestyle="--", linewidth=1,
                         label="zero, S1 Fig. 3.14")  # fmt: skip
            near.set_xlim(-60.0, 0.0)
    for axes in grid[:, 1]:
        axes.set_ylabel("")
    look.legend(grid[1, 0])


TEST = Procedure("root-locus", "Root locus of force feedback", run, draw, Chapter.DYNAMICS, 5)
