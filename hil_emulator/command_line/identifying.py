"""Commands from measured data to a named effect."""

from pathlib import Path
from typing import Any

import click

from hil_emulator.bus import log_endings
from hil_emulator.command_line.kinds import (
    CONFIGURATION,
    OVERWRITE,
    Duration,
    NewFile,
    NewPicture,
    Output,
    QuantityType,
)
from hil_emulator.command_line.recordings import Examination, recordings
from hil_emulator.errors import UserError
from hil_emulator.platform.lean_start import lean_bus


def _lean(*files: Path) -> None:
    """Load python-can without its interfaces, if captures need it."""
    if any(file.suffix.lower() in log_endings.SUFFIXES for file in files):
        lean_bus()


def _meaning(options: dict[str, Any]) -> Any:
    from hil_emulator.api.logs import Meaning, pairs

    names, units = pairs(options.pop("channels"))
    acts = options.pop("current_acts")
    options["set_point_first"] = None if acts is None else acts == "before"
    headings = [cell.strip() for cell in options.pop("columns").split(",") if cell.strip()]
    return Meaning(names=names, units=units, headings=headings, **options)


def _course(options: dict[str, Any]) -> Any:
    return options.pop("set_points") or "unknown"


@click.command(cls=Examination)
@recordings
@click.option("--only", multiple=True, metavar="EFFECT", help="Consider only this effect.")
@click.option("--exclude", multiple=True, metavar="EFFECT", help="Do not consider this effect.")
@click.option(
    "--method",
    type=click.Choice(["search", "least-squares"]),
    default="search",
    help="least-squares: also fit the named effects by ordinary least squares.",
)
def identify(
    files: tuple[Path, ...], validate: tuple[Path, ...], only: tuple[str, ...],
    exclude: tuple[str, ...], out: Path | None, jobs: int, cluster: str, **options: Any,
) -> None:  # fmt: skip
    """Name physical effects that recordings show and the configuration lacks."""
    _lean(*files, *validate)
    from hil_emulator.commands import identify as command
    from hil_emulator.identify.session import Question

    plain_fit, overwrite = options.pop("method") == "least-squares", options.pop("overwrite")
    question = Question(only, exclude, plain_fit=plain_fit, set_points=_course(options))
    meaning = _meaning(options)
    command.identify(files, validate, question, out, jobs, meaning, cluster, overwrite=overwrite)


@click.command(cls=Examination)
@recordings
def gap(
    files: tuple[Path, ...], validate: tuple[Path, ...], out: Path | None, jobs: int, cluster: str,
    overwrite: bool, **options: Any,
) -> None:  # fmt: skip
    """Measure where a recording and the configuration disagree."""
    _lean(*files, *validate)
    from hil_emulator.commands import identify as command
    from hil_emulator.identify.session import Question

    question = Question(search=False, set_points=_course(options))
    meaning = _meaning(options)
    command.identify(files, validate, question, out, jobs, meaning, cluster, overwrite=overwrite)


@click.command()
@click.argument("name", required=False)
@click.option(
    "--amplitude", type=QuantityType("m", "12 mm"), help='Largest deviation, such as "12 mm".'
)
@click.option("--duration", type=Duration(), help='How long, such as "2 s".')
@click.option(
    "--seed", type=click.IntRange(min=0), default=1, show_default=True,
    help="Seed of levels and phases.",
)  # fmt: skip
@click.option(
    "--config", "configs", multiple=True, type=CONFIGURATION,
    help="The machine, for its stops and its valve.",
)  # fmt: skip
@click.option("--out", type=NewFile(), help="Stimulus file; NAME.csv without it.")
@click.option("--picture", type=NewPicture(), help="Draw it.")
@click.option("--scenario", type=NewFile(), help="Write a scenario that plays it.")
@OVERWRITE
def experiment(
    name: str | None, amplitude: float | None, duration: float | None, seed: int,
    configs: tuple[Path, ...], **outputs: Any,
) -> None:  # fmt: skip
    """Write the stimulus file of an experiment; without NAME, list the experiments."""
    from hil_emulator.commands import experiment as command

    if name is None:
        command.catalogue(configs)
        return
    command.write(name, configs, amplitude, duration, seed, command.Outputs(**outputs))


@click.command()
@click.argument("effects", nargs=-1)
@click.option(
    "--size", "sizes", multiple=True, help="small, medium, large, or a value; one per effect."
)
@click.option("--config", "configs", multiple=True, type=CONFIGURATION, help="The machine.")
@click.option(
    "--seed", type=click.IntRange(min=0), help="Seed of the machine and its noise, to repeat it."
)
@click.option("--surprise", is_flag=True, help="Draw the effects at random and do not print them.")
@click.option("--duration", type=Duration(), help='Of each experiment, such as "3 s".')
@click.option("--out", type=Output(is_folder=True), help="Folder of the logs.")
@OVERWRITE
@click.option("--play", type=click.Path(path_type=Path), help="Record a stimulus file in --out.")
@click.option(
    "--open", "opened", type=click.Path(path_type=Path), help="Show the hidden effects of a folder."
)
def hide(
    effects: tuple[str, ...], sizes: tuple[str, ...], out: Path | None, play: Path | None,
    opened: Path | None, overwrite: bool, **drawn: Any,
) -> None:  # fmt: skip
    """Simulate experiments with hidden EFFECTs to practise on; `nothing` hides no effect."""
    from hil_emulator.commands import hide as command

    if opened is not None:
        command.reveal(opened)
        return
    if out is None:
        raise UserError("name the folder of the logs: --out FOLDER")
    if play is not None:
        command.play(play, out)
        return
    command.hide(effects, sizes or ("medium",), out=out, overwrite=overwrite, **drawn)


COMMANDS = (identify, gap, experiment, hide)
