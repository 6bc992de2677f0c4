"""Friction under sines of several speeds, as S1 Fig. 3.9."""

import math

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.friction_force import (
    DOCUMENT_FIT,
    ILLUSTRATED,
    columns,
    comparisons,
    fit,
    has_excess,
    speed_and_friction,
)
from hil_emulator.characterise.motion import Mover, sine
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import BenchResult, DocumentFigure, column
from hil_emulator.characterise.size import fastest
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, BLUE, GREEN, PINK, SKY, VERMILION

_HERTZ = (0.1, 0.5, 1.0, 2.0)
_PART = 0.3  # amplitude, part of the stroke: 0.3 m/s at 2 Hz and 80 mm
_SHOWN = 400  # points per sine in the table


def run(bench: Bench) -> BenchResult:
    """Move the rod on sines; friction is pressure force minus load cell."""
    stroke = bench.value("cylinder_stroke")
    centre = 0.5 * stroke
    parts, speeds, forces = [], [], []
    for hertz in _HERTZ:
        stand = bench.stand({"initial_position": centre})
        reach = min(_PART * stroke, fastest(bench) / (2.0 * math.pi * hertz))
        record = Mover(bench, stand).follow(sine(centre, reach, hertz, stand.period, 3.0))
        velocity, force = speed_and_friction(bench, record.after(1.0 / hertz))
        keep = np.linspace(0, len(velocity) - 1, 4000).astype(int)  # equal weight of each sine
        speeds.append(velocity[keep])
        forces.append(force[keep])
        parts.append(np.full(len(keep), hertz))
    v, f, hertz_of = (np.concatenate(p) for p in (speeds, forces, parts))
    fitted = fit(v, f, has_excess(bench))
    shown = slice(None, None, len(v) // (_SHOWN * len(_HERTZ)))
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Sines of ±30 % of the stroke about its middle at 0.1 to 2 Hz, smaller if the speed "
            "would exceed 40 % of the no-load speed. Friction is the force "
            "of both pressure sensors minus the load cell, velocity the mean difference of the "
            "position sensor over 10 ms; S1 eq. 3.18 is fitted above 3 mm/s."
        ),
        columns={"frequency": column("Hz", hertz_of[shown])} | columns(v[shown], f[shown], fitted),
        comparisons=comparisons(bench, fitted),
        notes=[f"Offset of the sensors at standstill: {fitted.zero:+.1f} N; subtracted."],
        figures=[
            DocumentFigure("S1 Fig. 3.8", "F_c0 = 100 N, F_s0 = 100 N, C_s = 0.02 m/s, "
                           "B = 1000 N s/m, for illustration", "its curve, by S1 eq. 3.18"),
            DocumentFigure("S1 Fig. 3.9", "the line fitted through its points: B = 1000 N s/m and "
                           "F_c0 = 100 N (S1 3.4.2)", "that line; S1 does not state the points"),
        ],
    )  # fmt: skip


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw friction against velocity."""
    axes = figure.add_subplot()
    for hertz, colour in zip(_HERTZ, (SKY, GREEN, VERMILION, BLUE), strict=True):
        v, f = (result.where("frequency", hertz, name) for name in ("velocity", "friction"))
        axes.plot(v, f, ".", markersize=2, color=colour)
        axes.plot([], [], "o", color=colour, label=f"{hertz:g} Hz")
    order = np.argsort(result["velocity"])
    axes.plot(result["velocity"][order], result["fit of S1 eq. 3.18"][order], color=BLACK,
              linewidth=1, label="S1 eq. 3.18 fitted")  # fmt: skip
    grid = np.linspace(np.min(result["velocity"]), np.max(result["velocity"]), 400)
    laws = (("3.8", ILLUSTRATED, ":"), ("3.9", DOCUMENT_FIT, "--")) if result.figures else ()
    for name, law, line in laws:
        axes.plot(grid, law(grid), line, color=PINK, linewidth=2, label=f"S1 Fig. {name}")
    look.label(
        axes, "velocity [m/s]", "friction [N]", "Friction from pressure sensors and load cell"
    )
    look.legend(axes)


TEST = Procedure(
    "friction", "Friction under sines of several speeds", run, draw, Chapter.CYLINDER, 2
)
