"""Poles of valve, cylinder and load along the stroke (S1 3.5, root locus).

The oil columns make the actuator softest near the middle. Poles of the exact linearisation of the
model beside those of S1 eq. 3.38, which ties both pressures together, and of its complete form,
which does not. Dry friction, leakage and air are switched off, as in the linear model.
"""

import math
from collections.abc import Mapping
from itertools import product

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.procedure import Procedure
from hil_emulator.characterise.result import Comparison, Result, column
from hil_emulator.characterise.stand import Bench
from hil_emulator.model import linear, linearise

_PARTS = np.linspace(0.05, 0.95, 19)  # positions, parts of the stroke
_OPENINGS = (-0.2, 0.1, 0.5)  # parts of the rated current
_COMPARED = (0, 4, 9, 14, 18)  # five of them


def rest_point(rest: linearise.Linearisation) -> linear.OperatingPoint:
    """Return the operating point of the analytic forms at rest."""
    at = rest.signals
    return linear.OperatingPoint(
        at["spool_position"], at["position"], at["pressure_a"], at["pressure_b"]
    )


def _worst_pole(bench: Bench, values: Mapping[str, float], machine: linear.Machine) -> float:
    """Return the largest relative distance of an analytic pole from the exact one nearest to it.

    In steady motion at five positions and three openings, every pole of the complete form.
    """
    worst = 0.0
    for part, opening in product(_PARTS[list(_COMPARED)], _OPENINGS):
        at = (opening * bench.rated_current, part * machine.stroke)
        motion = linearise.steady_motion(bench.kernel, values, *at)
        poles = linear.complete(machine, rest_point(motion)).load_force.poles
        nearest = [float(np.min(np.abs(motion.poles - p)) / abs(p)) for p in poles]
        worst = max(worst, *nearest)
    return worst


def _resonance(poles: NDArray[np.complex128]) -> complex:
    """Return the slowest pole that swings, upper half plane."""
    swinging = poles[np.imag(poles) > 1.0]
    return complex(swinging[np.argmin(np.abs(swinging))]) if len(swinging) else complex(np.nan)


def run(bench: Bench) -> Result:
    """Linearise at rest along the stroke."""
    off = bench.off("friction", "oil", "cylinder", keep=("viscous_friction",))
    values = {**bench.values, **off}
    machine = linear.Machine.of(values)
    rows = []
    for position in _PARTS * machine.stroke:
        rest = linearise.rest(bench.kernel, values, position)
        at = rest_point(rest)
        forms = (linear.reduced(machine, at), linear.complete(machine, at))
        found = [_resonance(rest.poles), *(_resonance(f.hydraulic_force.poles) for f in forms)]
        rows.append((position * 1e3, *(part for p in found for part in (p.real, p.imag))))
    table = np.array(rows).T
    names = [f"{part}, {form}" for form in ("exact", "S1 eq. 3.38", "complete")
             for part in ("real", "imaginary")]  # fmt: skip
    columns = {"position": column("mm", table[0])} | {
        name: column("rad/s", v) for name, v in zip(names, table[1:], strict=True)
    }
    exact, complete = table[1] + 1j * table[2], table[5] + 1j * table[6]
    return Result(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Exact linearisation at rest at 19 positions, dry friction, leakage and air "
            "switched off; the pole pair of oil columns and load."
        ),
        columns=columns,
        comparisons=[
            Comparison(f"resonance at {table[0][i]:.0f} mm", "Hz",
                       float(abs(complete[i])) / 2 / math.pi, "S1 eq. 3.11-3.26, complete form",
                       float(abs(exact[i])) / 2 / math.pi, 0.01)
            for i in _COMPARED
        ]
        + [
            Comparison("decay of the resonance at mid-stroke", "1/s", float(-complete[9].real),
                       "S1 eq. 3.11-3.26, complete form", float(-exact[9].real), 0.03),
            Comparison("exact over analytic pole, worst of 5 positions x 3 openings", "1", 1.0,
                       "S1 eq. 3.11-3.26, complete form", 1.0 + _worst_pole(bench, values, machine),
                       0.01),
        ],
        notes=[
            "S1 eq. 3.38 uses the steady-state relation of both pressures in motion, which costs "
            f"{abs(table[3][9] / table[1][9] - 1.0):.1%} of the damping at mid-stroke."
        ],
    )  # fmt: skip


def draw(result: Result, figure: Figure) -> None:
    """Draw the resonance along the stroke, and the poles in the complex plane."""
    along, plane = figure.subplots(1, 2)
    forms = (
        ("exact", "o", look.BLUE),
        ("S1 eq. 3.38", "x", look.BLACK),
        ("complete", "+", look.ORANGE),
    )
    for form, mark, colour in forms:
        real, imaginary = result[f"real, {form}"], result[f"imaginary, {form}"]
        along.plot(result["position"], np.hypot(real, imaginary) / 2 / math.pi, mark, color=colour,
                   markersize=5, markerfacecolor="none", label=form)  # fmt: skip
        plane.plot(real, imaginary, mark, color=colour, markersize=5, markerfacecolor="none")
    along.set_ylim(bottom=0)
    look.label(along, "position [mm]", "natural frequency [Hz]", "Oil columns and load")
    look.label(plane, "real part [rad/s]", "imaginary part [rad/s]", "Poles along the stroke")
    look.legend(along)


TEST = Procedure("force-poles", "Poles along the stroke", run, draw)
