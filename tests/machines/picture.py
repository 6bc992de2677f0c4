"""Picture of docs/reference/machines.md: every worked machine at a tenth of full current.

python -m tests.machines.picture docs/pictures/machines.png
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hil_emulator.characterise.size import quickness
from hil_emulator.characterise.stand import Bench
from hil_emulator.config.load import load
from hil_emulator.model.kernel import Kernel, build
from hil_emulator.pages.palette import BLACK, BLUE, VERMILION
from hil_emulator.platform.packaged import packaged
from hil_emulator.platform.paths import cache_folder

WORKED = ("micro_rig", "hyq_knee", "test_axis", "press", "excavator_boom")
_PART = 0.1  # of the rated current
_LONG = 20.0  # of the picture, in periods of the machine's natural frequency


def play(model: Kernel, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and position [mm], pressures a and b [bar] of one machine; shape (3, n)."""
    config = load([packaged()[name]])
    bench = Bench(model, config.plant, config.sensors, step=config.step)
    stand = bench.stand({})
    period = 1.0 / (60.5 * quickness(bench))
    time = np.arange(0.0, _LONG * period, stand.period)
    share = np.select([time < 2 * period, time < 8 * period, time < 14 * period], [0.0, 1.0, -1.0])
    signals = stand.drive(_PART * bench.rated_current * share).signals
    rows = (signals["position"] * 1e3, signals["pressure_a"] * 1e-5, signals["pressure_b"] * 1e-5)
    return time, np.array(rows)


def main(file: Path) -> None:
    """Draw it."""
    model = build(cache=cache_folder())
    figure = Figure(figsize=(11.0, 4.6), dpi=110, layout="constrained")
    grid = figure.subplots(2, len(WORKED))
    for column, name in enumerate(WORKED):
        time, (position, pressure_a, pressure_b) = play(model, name)
        above, below = grid[0, column], grid[1, column]
        above.set_title(name.replace("_", " "), fontsize="medium")
        above.plot(time, position, color=BLACK, linewidth=1)
        below.plot(time, pressure_a, color=BLUE, linewidth=1, label="pressure a")
        below.plot(time, pressure_b, color=VERMILION, linewidth=1, label="pressure b")
        below.set_xlabel("time [s]")
        for axes in (above, below):
            axes.spines[["top", "right"]].set_visible(False)
            axes.tick_params(labelsize="small")
    grid[0, 0].set_ylabel("position [mm]")
    grid[1, 0].set_ylabel("pressure [bar]")
    figure.legend(
        *grid[1, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2,
        frameon=False, fontsize="small",
    )  # fmt: skip
    figure.savefig(file)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
