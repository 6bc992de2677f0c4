"""Commands that show the content of a model and the speed of a machine."""

from pathlib import Path

import click

from hil_emulator.command_line.kinds import (
    CONFIGURATION,
    FILES,
    OVERWRITE,
    Duration,
    NewPicture,
    Output,
    QuantityType,
)


@click.command()
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def effects(files: tuple[Path, ...], as_json: bool) -> None:
    """Print the catalogue of physical effects, with those of a configuration's own files."""
    from hil_emulator.commands import effects as command

    command.effects(files, as_json)


@click.command()
@FILES
@click.option(
    "--position",
    type=QuantityType("m", "40 mm"),
    help='Position of the rod, such as "40 mm"; default: the start.',
)
@click.option(
    "--current",
    type=QuantityType("A", "1 mA"),
    default="0 mA",
    help='Valve current, such as "1 mA"; 0 mA: at rest.',
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, in SI.")
@click.option(
    "--picture",
    type=NewPicture(),
    help="Draw the frequency responses.",
)
@OVERWRITE
def linear(
    files: tuple[Path, ...],
    position: float | None,
    current: float,
    as_json: bool,
    picture: Path | None,
    *,
    overwrite: bool,
) -> None:
    """Linearise an actuator: S1's coefficients, poles and zeros, and the exact ones."""
    from hil_emulator.commands import linear as command

    command.run(files, position, current, as_json, picture, overwrite=overwrite)


@click.command()
@click.argument("test")
@FILES
@click.option(
    "--out",
    type=Output(is_folder=True),
    default="characterisation",
    show_default=True,
    help="Folder for tables, pictures and the page.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Seed of the sensors' noise.")
@OVERWRITE
def characterise(
    test: str, files: tuple[Path, ...], out: Path, seed: int | None, *, overwrite: bool
) -> None:
    """Test the emulated actuator on a virtual bench; TEST is "all" or the name of a test."""
    from hil_emulator.commands import characterise as command

    command.run(test, files, out, seed, overwrite=overwrite)


@click.command()
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION)
@click.option("--duration", type=Duration(), default="10 s", help="Duration of the real-time part.")
@click.option("--identify", type=Duration(), help='Measure a search in "60 s" of data instead.')
@click.option("--panel", is_flag=True, help="Measure the cost of the panel instead, by open pages.")
@click.option(
    "--effects", is_flag=True, help="Measure the cost of each effect that is off instead."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, in microseconds.")
def bench(
    files: tuple[Path, ...], duration: float, identify: float | None, panel: bool, effects: bool,
    as_json: bool,
) -> None:  # fmt: skip
    """Measure the emulator's speed and timing on this machine."""
    from hil_emulator.commands import bench as command

    if effects:
        command.bench_effects(files, as_json)
        return
    command.bench(files, duration, identify, as_json, panel)


COMMANDS = (effects, linear, characterise, bench)
