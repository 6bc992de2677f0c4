"""`hil-emulator experiment`: the library of experiments, and their stimulus files."""

import os
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from hil_emulator.commands.text_table import text_table
from hil_emulator.config.load import Configuration, load_rig, load_whole
from hil_emulator.identify.experiment_design.library import (
    LIBRARY,
    Target,
    limits,
    stimulus,
    target,
)
from hil_emulator.pages import drawing
from hil_emulator.pages.palette import BLUE
from hil_emulator.platform.output_files import new_files, refuse_existing
from hil_emulator.platform.paths import near, shipped
from hil_emulator.units import show

REST = 0.3
"""Time before a scenario begins to play [s]: the rod comes to rest."""


def catalogue(configs: Sequence[Path]) -> None:
    """Print every experiment, with its usual amplitude for a machine."""
    allowed = limits(load_whole(configs or [shipped("configs/hyq_knee.toml")]).plant)
    rows = [
        (e.name, show(target(e, allowed).amplitude, "m", "mm"), f"{e.duration:g} s", e.summary,
         e.shows)
        for e in LIBRARY
    ]  # fmt: skip
    click.echo(text_table(("experiment", "amplitude", "lasts", "the rod", "shows well"), rows))


@dataclass(frozen=True)
class Outputs:
    """The files of a stimulus.

    Attributes:
        out: the stimulus itself; NAME.csv without it.
        picture: of its course over time.
        scenario: plays it.
        overwrite: whether files that exist are replaced.

    """

    out: Path | None = None
    picture: Path | None = None
    scenario: Path | None = None
    overwrite: bool = False


def write(
    name: str, configs: Sequence[Path], amplitude: float | None, duration: float | None, seed: int,
    outputs: Outputs,
) -> None:  # fmt: skip
    """Write a stimulus file.

    Args:
        name: entry of the library.
        configs: the machine; the reference machine without any.
        amplitude: largest deviation from the centre [m].
        duration: [s].
        seed: of levels and phases.
        outputs: the files to write.

    Raises:
        UserError: for an unknown experiment, one that the machine cannot do, a file that exists or
            cannot be written, or a scenario of a machine without nodes.

    """
    files = list(configs) or [shipped("configs/hyq_knee.toml")]
    picture, scenario = outputs.picture, outputs.scenario
    config = load_whole(files) if scenario is None else load_rig(files)
    made = target(stimulus(name), limits(config.plant), amplitude, duration, seed)
    file = outputs.out or Path(f"{name}.csv")
    refuse_existing(filter(None, (file, picture, scenario)), overwrite=outputs.overwrite)
    with new_files(overwrite=outputs.overwrite) as staged:
        staged(file).write_text(stimulus_file(made), encoding="utf-8")
        if picture is not None:
            _draw(made, staged(picture))
        if scenario is not None:
            text = playing(made, file, config, scenario.parent)
            staged(scenario).write_text(text, encoding="utf-8")
    click.echo(f"stimulus  {near(file)}: {described(made)}")
    if picture is not None:
        click.echo(f"picture   {near(picture)}")
    if scenario is not None:
        click.echo(f"scenario  {near(scenario)}; play it on the bus:")
        click.echo(f"          hil-emulator scenario {near(scenario)} --record recordings")


def described(made: Target) -> str:
    """Return the motion in numbers."""
    low, high = 1e3 * float(made.position.min()), 1e3 * float(made.position.max())
    text = f"{made.stimulus.summary}; {len(made.time) * 1e-3:g} s, {low:.1f} ... {high:.1f} mm"
    if made.stimulus.jumps:
        return text
    speed = float(np.max(np.abs(np.gradient(made.position, made.time))))
    return f"{text}, up to {1e3 * speed:.0f} mm/s"


def stimulus_file(made: Target) -> str:
    """Return an experiment as the scenario's `profile` and a spreadsheet read it."""
    rows = zip(made.time.tolist(), made.position.tolist(), strict=True)
    lines = ["time [s],position [m]", *(f"{t:.6f},{x:.7f}" for t, x in rows)]
    return "\n".join(lines) + "\n"


def playing(made: Target, file: Path, config: Configuration, folder: Path) -> str:
    """Return a scenario that plays a stimulus file, with paths relative to its folder."""

    def relative(path: Path) -> str:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()

    names = ", ".join(f'"{relative(c)}"' for c in config.files)
    begin = show(made.position[0], "m", "mm")
    return f'''# Plays {file.name}: {made.stimulus.summary}.
title = "{made.stimulus.name}"
config = [{names}]
duration = "{len(made.time) * 1e-3 + REST:g} s"
seed = {zlib.crc32(made.position.tobytes()) % 100000}                    # noise of its own

[[step]]
at = "10 ms"
nmt = "start"
set = {{ position = "{begin}" }}

[[step]]
at = "{REST:g} s"
profile = {{ signal = "position", file = "{relative(file)}" }}

[[expect]]                      # the node reports no error
frame = "0x{0x080 + config.nodes[0].id:03X}"
seen = false
'''


def _draw(made: Target, file: Path) -> None:
    """Draw the target over time."""
    figure, axis = drawing.subplots((8, 3))
    axis.plot(made.time, 1e3 * made.position, lw=1.0, color=BLUE)
    axis.set_xlabel("time [s]")
    axis.set_ylabel("target position [mm]")
    axis.set_title(f"{made.stimulus.name}: {made.stimulus.summary}", loc="left", fontsize=10)
    axis.grid(alpha=0.3)
    drawing.save(figure, file, 130)
