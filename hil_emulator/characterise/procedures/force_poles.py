"""Poles of valve, cylinder and load along the stroke (S1 3.5, root locus).

The stiffness of the oil columns is smallest near the middle. Poles of the exact linearisation of
the model are compared with those of S1 eq. 3.38, which couples both pressures statically, of its
complete form without this coupling, and of the machine as configured.
"""

import math
from collections.abc import Mapping
from itertools import product

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import Agreement, BenchResult, Comparison, Series, column
from hil_emulator.characterise.stand import Bench
from hil_emulator.model import linear, linearise
from hil_emulator.model.equilibrium import NoEquilibriumError
from hil_emulator.model.smoothed import at_the_edge
from hil_emulator.pages.palette import BLACK, BLUE, GREEN, VERMILION

_PARTS = np.linspace(0.05, 0.95, 19)  # positions, parts of the stroke
_OPENINGS = (-0.2, 0.1, 0.5)  # parts of the rated current
_COMPARED = (0, 4, 9, 14, 18)  # five of them


_FORMS = ("exact", "as configured", "complete", "S1 eq. 3.38")
_S1_EFFECTS = ("viscous_friction", "load_viscous_friction")
_TABLES = ("supply", "tank", "valve", "oil", "cylinder", "friction", "load")
_NONE = complex(math.nan, math.nan)

Poles = NDArray[np.complex128]


def s1_values(bench: Bench) -> dict[str, float]:
    """Return the parameters with only the effects of S1's linear model.

    Its edges are turbulent and sharp, and open at null.
    """
    edges = {"underlap_lap": bench.null_opening, "valve_critical_reynolds_number": 0.0}
    return {**bench.values, **bench.off(*_TABLES, keep=_S1_EFFECTS), **edges}


def rest_point(rest: linearise.Linearisation) -> linear.OperatingPoint:
    """Return the operating point of the analytic forms at rest."""
    at = rest.signals
    return linear.OperatingPoint(
        at["spool_position"], at["position"], at["pressure_a"], at["pressure_b"]
    )


def _worst_pole(
    bench: Bench, values: Mapping[str, float], machine: linear.LinearisedMachine
) -> float:
    """Return the largest relative distance of an analytic pole from the nearest exact pole.

    All poles of the complete form are compared, in steady motion at five positions and three
    openings.
    """
    worst = 0.0
    for part, opening in product(_PARTS[list(_COMPARED)], _OPENINGS):
        at = (opening * bench.rated_current, part * machine.stroke)
        motion = linearise.steady_motion(bench.kernel, values, *at)
        poles = linear.complete(machine, rest_point(motion)).load_force.poles
        nearest = [float(np.min(np.abs(motion.poles - p)) / abs(p)) for p in poles]
        worst = max(worst, *nearest)
    return worst


def _resonance(poles: Poles, spool: complex) -> complex:
    """Return the slowest oscillating pole other than the spool's, upper half plane."""
    swinging = poles[np.imag(poles) > 1.0]
    if len(swinging) and spool.imag > 1.0:
        swinging = np.delete(swinging, np.argmin(np.abs(swinging - spool)))
    return complex(swinging[np.argmin(np.abs(swinging))]) if len(swinging) else _NONE


def _along_the_stroke(bench: Bench, values: Mapping[str, float]) -> dict[str, Poles]:
    """Return the resonance of every form at rest at each position."""
    machine = linear.LinearisedMachine.of(values)
    wet = at_the_edge({**bench.values, **bench.smooth()})
    spool = machine.spool_pole
    resonances: dict[str, list[complex]] = {form: [] for form in _FORMS}
    for position in _PARTS * machine.stroke:
        rest = linearise.rest(bench.kernel, values, position)
        at = rest_point(rest)
        resonances["exact"].append(_resonance(rest.poles, spool))
        for form, poles in (("S1 eq. 3.38", linear.reduced), ("complete", linear.complete)):
            resonances[form].append(_resonance(poles(machine, at).hydraulic_force.poles, spool))
        try:
            resonance = _resonance(linearise.rest(bench.kernel, wet, position).poles, spool)
        except NoEquilibriumError:
            resonance = _NONE
        resonances["as configured"].append(resonance)
    return {form: np.array(poles) for form, poles in resonances.items()}


def _comparisons(
    resonances: Mapping[str, Poles], position: Series, worst: float
) -> list[Comparison]:
    exact, complete = resonances["exact"], resonances["complete"]
    source, middle = "S1 eq. 3.11-3.26, complete form", len(position) // 2
    rows = [
        (f"resonance at {position[i] * 1e3:.0f} mm", "Hz", abs(complete[i]) / 2 / math.pi,
         abs(exact[i]) / 2 / math.pi)
        for i in _COMPARED
    ]  # fmt: skip
    rows += [
        ("decay of the resonance at mid-stroke", "1/s", -complete[middle].real,
         -exact[middle].real),
    ]  # fmt: skip
    name = "exact over analytic pole, worst of 5 positions x 3 openings"
    return [
        *(
            Comparison(q, unit, float(e), source, float(m), 0.01, Agreement.DERIVED)
            for q, unit, e, m in rows
        ),
        Comparison(name, "1", 1.0, source, 1.0 + worst, 0.02, Agreement.DERIVED),
    ]


def run(bench: Bench) -> BenchResult:
    """Linearise at rest along the stroke."""
    values = s1_values(bench)
    machine = linear.LinearisedMachine.of(values)
    resonances = _along_the_stroke(bench, values)
    position = _PARTS * machine.stroke
    middle = len(position) // 2
    cost = resonances["S1 eq. 3.38"][middle].real / resonances["exact"][middle].real - 1.0
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Exact linearisation at rest at 19 positions, with the effects of S1's linear model "
            "and as configured without dry friction; the pole pair of oil columns and load."
        ),
        columns={"position": column("mm", position * 1e3)}
        | {
            f"{part}, {form}": column("rad/s", values)
            for form, poles in resonances.items()
            for part, values in (("real", poles.real), ("imaginary", poles.imag))
        },
        comparisons=_comparisons(resonances, position, _worst_pole(bench, values, machine)),
        again=lambda other: run(other).comparisons,
        notes=[
            "S1 eq. 3.38 uses the steady-state relation of both pressures in motion, which changes "
            f"the damping at mid-stroke by {abs(cost):.1%}."
        ],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the resonance along the stroke, and the poles in the complex plane."""
    along, plane = figure.subplots(1, 2)
    marks = zip(_FORMS, "os+x", (BLUE, GREEN, VERMILION, BLACK), strict=True)
    for form, mark, colour in marks:
        real, imaginary = result[f"real, {form}"], result[f"imaginary, {form}"]
        along.plot(result["position"], np.hypot(real, imaginary) / 2 / math.pi, mark, color=colour,
                   markersize=5, markerfacecolor="none", label=form)  # fmt: skip
        plane.plot(real, imaginary, mark, color=colour, markersize=5, markerfacecolor="none")
    along.set_ylim(bottom=0)
    look.label(along, "position [mm]", "natural frequency [Hz]", "Oil columns and load")
    look.label(plane, "real part [rad/s]", "imaginary part [rad/s]", "Poles along the stroke")
    look.legend(along)


TEST = Procedure("force-poles", "Poles along the stroke", run, draw, Chapter.DYNAMICS, 3)
