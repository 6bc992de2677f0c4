"""`hil-emulator plot`: the signals of a recording as a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil_emulator.commands.waiting import waiting
from hil_emulator.errors import UserError, did_you_mean
from hil_emulator.pages import drawing
from hil_emulator.platform.output_files import refuse_existing
from hil_emulator.platform.paths import near
from hil_emulator.recording import journal
from hil_emulator.recording.journal import Recording
from hil_emulator.signals.columns import MODEL
from hil_emulator.units import factor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

USUAL = ("position", "load_force", "pressure_a", "pressure_b", "supply_pressure", "valve_current")
"""Default signals of a picture."""

_SHOWN = {"Pa": "bar", "m": "mm", "A": "mA", "m/s": "mm/s", "m^3/s": "l/min"}

_QUIET = {"serve", "slipped"}
"""Events that are not drawn, because they do not act on the rig."""


def plot(
    file: Path, names: Sequence[str], picture: Path | None, *, overwrite: bool = False
) -> None:
    """Draw signals of a recording over time, one axis per unit.

    Raises:
        UserError: for an unknown signal or a file that cannot be read, exists or cannot be written.

    """
    target = picture or file.with_suffix(".png")
    refuse_existing([target], overwrite=overwrite)
    with waiting("plot", [file]):
        figure = drawn(journal.read(file), names or USUAL)
        drawing.save(figure, target, overwrite=overwrite)
    click.echo(f"picture: {near(target)}")


def drawn(recording: Recording, names: Sequence[str]) -> "Figure":
    """Return the picture; dots mark actions on the rig."""
    units, table = recording.units, recording.table()
    for name in names:
        if name not in units:
            raise UserError(f"no signal '{name}'{did_you_mean(name, units)}")
    chosen = list(dict.fromkeys(units[name] for name in names))
    size = (9, 2.4 * len(chosen) + 0.6)
    figure, axes = drawing.subplots(size, len(chosen), sharex=True, squeeze=False)
    for axis, unit in zip(axes[:, 0], chosen, strict=True):
        shown = _SHOWN.get(unit, unit)
        for name in [n for n in names if units[n] == unit]:
            dashed = "--" if name.startswith(MODEL) else "-"
            axis.plot(table["time"], table[name] / factor(unit, shown), dashed, lw=0.9, label=name)
        for now_ns in [now for now, what in recording.events if not what.keys() & _QUIET]:
            axis.axvline(now_ns * 1e-9, color="0.6", lw=0.6, ls=":")
        axis.set_ylabel(shown)
        axis.grid(alpha=0.3)
        axis.legend(loc="upper left", fontsize=8, ncols=3)
    axes[-1, 0].set_xlabel("emulator time [s]")
    origin = recording.provenance
    figure.suptitle(f"{origin['configuration']} (digest {origin['digest']})", fontsize=10)
    return figure
