"""Friction at constant speeds (the procedure of S2).

At constant speed the acceleration is 0, so S2 eq. 8 gives friction = driving force - load without a
derivative. One mean per speed and direction.
"""

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise import figure as look
from hil_emulator.characterise.friction_force import (
    columns,
    comparisons,
    fit,
    has_excess,
    speed_and_friction,
)
from hil_emulator.characterise.motion import Mover, stroke
from hil_emulator.characterise.procedure import Chapter, Procedure
from hil_emulator.characterise.result import BenchResult
from hil_emulator.characterise.size import fastest, quickness
from hil_emulator.characterise.stand import Bench
from hil_emulator.pages.palette import BLACK, VERMILION

_SPEEDS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3)  # [m/s]
_FROM, _LENGTH = 0.15, 0.7  # start and length of a stroke, parts of the whole one
_LONGEST = 4.0  # a slow stroke ends early [s]


def _one_speed(bench: Bench, velocity: float) -> tuple[float, float]:
    """Return mean velocity and friction over the second half of one stroke."""
    whole = bench.value("cylinder_stroke")
    start = whole * (_FROM if velocity > 0.0 else 1.0 - _FROM)
    longest = _LONGEST / min(1.0, quickness(bench))
    length = min(_LENGTH * whole, longest * abs(velocity))
    stand = bench.stand({"initial_position": start})
    record = Mover(bench, stand).follow(stroke(start, velocity, length, stand.period))
    v, force = speed_and_friction(bench, record.after(0.5 * record.time[-1]))
    return float(np.mean(v)), float(np.mean(force))


def run(bench: Bench) -> BenchResult:
    """Move the rod at constant speeds in both directions."""
    share = min(1.0, fastest(bench) / _SPEEDS[-1])
    speeds = [max(_SPEEDS[0], share * speed) for speed in _SPEEDS]
    points = [_one_speed(bench, sign * speed) for sign in (-1.0, 1.0) for speed in speeds]
    v, f = np.array(sorted(points)).T
    fitted = fit(v, f, has_excess(bench))
    return BenchResult(
        name=TEST.name,
        title=TEST.title,
        procedure=(
            "Seven constant speeds in each direction; mean of pressure force minus load cell over "
            "the second half of each stroke; S1 eq. 3.18 is fitted through the means."
        ),
        columns=columns(v, f, fitted),
        comparisons=comparisons(bench, fitted),
        notes=[f"Offset of the sensors at standstill: {fitted.zero:+.1f} N; subtracted."],
    )


def draw(result: BenchResult, figure: Figure) -> None:
    """Draw the mean friction at each speed."""
    axes = figure.add_subplot()
    axes.plot(
        result["velocity"], result["friction"], "o", color=VERMILION, label="mean of a stroke"
    )
    v, fitted = result["velocity"], result["fit of S1 eq. 3.18"]
    for side, text in ((v > 0.0, "S1 eq. 3.18 fitted"), (v < 0.0, None)):
        axes.plot(v[side], fitted[side], color=BLACK, linewidth=1, label=text)
    look.label(axes, "velocity [m/s]", "friction [N]", "Friction at constant speed")
    look.legend(axes)


TEST = Procedure("friction-steady", "Friction at constant speeds", run, draw, Chapter.CYLINDER, 3)
