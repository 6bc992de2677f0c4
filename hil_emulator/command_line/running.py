"""Commands that run the emulator and use its recordings."""

from pathlib import Path
from typing import Any

import click

from hil_emulator.command_line.kinds import (
    CONFIGURATION,
    OVERWRITE,
    ROLE,
    SCENARIO,
    Duration,
    NewFile,
    NewPicture,
    Output,
    some_files,
)

DIRECTIONS = click.option(
    "--record-direction", "directions", is_flag=True,
    help="End each line of a .log in R or T, as replay needs it and Wireshark does not read it.",
)  # fmt: skip


@click.command()
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION, callback=some_files)
@click.option(
    "--scenario", "played", type=SCENARIO, is_eager=True,
    help="Play a scenario on the bus; its configuration is used if CONFIG is missing.",
)  # fmt: skip
@ROLE
@click.option("--junit", type=NewFile(), help="With --scenario: write JUnit XML.")
@click.option("--html", "page", type=NewFile(), help="With --scenario: write one HTML page.")
@click.option("--bus", metavar="INTERFACE:CHANNEL", help="Another bus, such as socketcan:vcan0.")
@click.option(
    "--clock",
    type=click.Choice(["wall", "lockstep", "follow-sync"]),
    default="wall",
    show_default=True,
    help="Real time, as fast as possible, or one period per SYNC.",
)
@click.option("--duration", type=Duration(), help='Emulator time to run, such as "60 s".')
@click.option(
    "--record",
    type=Output(),
    multiple=True,
    help="File to write; its ending is the format: .rec .csv .blf ..., an unknown one lists all.",
)
@DIRECTIONS
@click.option(
    "--require-recording", "required", is_flag=True, help="End the run if the recording ends early."
)
@OVERWRITE
@click.option("--trigger", help='Record only around a condition, such as "position > 60 mm".')
@click.option("--before", type=Duration(), default="5 s", help="How long before the trigger.")
@click.option("--after", type=Duration(), default="1 s", help="How long after the trigger.")
@click.option("--fault", "faults", multiple=True, help='TARGET KIND NAME=VALUE...; see "faults".')
@click.option(
    "--processes",
    type=click.IntRange(1),
    help="Processes for several actuators; default: one per core.",
)
@click.option("--port", type=click.IntRange(0, 65535), help="TCP port of the bus; 0: any free one.")
@click.option("--control", type=click.IntRange(0, 65535), help="Port of the remote control (ctl).")
@click.option("--panel", "panel", flag_value="full", help="Show the panel in a browser.")
@click.option(
    "--panel-view-only", "panel", flag_value="view only", help="Show the panel, read-only."
)
@click.pass_context
def run(
    ctx: click.Context,
    /,
    files: tuple[Path, ...],
    bus: str | None,
    clock: str,
    duration: float | None,
    record: tuple[Path, ...],
    faults: tuple[str, ...],
    **options: Any,
) -> None:
    """Run the emulator on its bus.

    With --scenario the exit code is 1 if an expectation is not met, 2 if the scenario cannot run.

    A run that falls behind real time is no valid test of a controller that keeps real time. Give
    the emulator a real-time priority (`you - rtprio 50` in /etc/security/limits.conf, and a new
    login), or use --clock follow-sync.
    """
    from hil_emulator.platform.lean_start import lean_start

    lean_start()
    from hil_emulator.commands import run as command
    from hil_emulator.commands.recording import ordered
    from hil_emulator.commands.run_scenario import scenario_options
    from hil_emulator.config.load import is_rotary
    from hil_emulator.units import axis

    opened = [options.pop(name) for name in ("port", "control", "panel", "processes")]
    played = {name: options.pop(name) for name in ("played", "role", "junit", "page")}
    operation = command.operation(*opened)
    with axis(rotary=is_rotary(files)):
        recording = ordered(record, **options)
    scenario = scenario_options(**played, overwrite=recording.overwrite)
    ctx.exit(command.run(files, bus, clock, duration, recording, faults, operation, scenario))


@click.command(context_settings={"ignore_unknown_options": True})  # "-0.5 mA" is a value
@click.option(
    "--port", type=click.IntRange(1, 65535), default=29537, show_default=True,
    help="Port of the emulator's --control.",
)  # fmt: skip
@click.argument("words", metavar="status|read|fault|end|set ...", nargs=-1)
def ctl(port: int, words: tuple[str, ...]) -> None:
    """Control an emulator that runs with --control."""
    from hil_emulator.commands import ctl as command

    command.ctl(port, words)


@click.command()
@click.option(
    "--picture",
    type=NewPicture(),
    default="hil-emulator-demo.png",
    show_default=True,
    help="File of the picture.",
)
@OVERWRITE
@click.pass_context
def demo(ctx: click.Context, picture: Path, *, overwrite: bool) -> None:
    """Run a controller against the emulator through CAN, without configuration."""
    from hil_emulator.commands import demo as command

    ctx.exit(0 if command.demo(picture, overwrite=overwrite) else 1)


@click.command()
@click.argument("path", metavar="RECORDING|FOLDER", type=click.Path(path_type=Path))
def panel(path: Path) -> None:
    """Show a recording (.rec), or the folder of `identify --out`, in a browser."""
    from hil_emulator.commands import panel as command

    command.panel(path)


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION)
@click.pass_context
def replay(ctx: click.Context, recording: Path, files: tuple[Path, ...]) -> None:
    """Feed a recorded controller's frames back; report where the response differs."""
    from hil_emulator.commands import replay as command

    ctx.exit(0 if command.replay(recording, files) else 1)


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("signals", nargs=-1)
@click.option("--picture", type=NewPicture(), help="File of the picture.")
@OVERWRITE
def plot(
    recording: Path, signals: tuple[str, ...], picture: Path | None, *, overwrite: bool
) -> None:
    """Draw signals of a recording."""
    from hil_emulator.commands import plot as command

    command.plot(recording, signals, picture, overwrite=overwrite)


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("targets", nargs=-1, required=True, type=Output())
@DIRECTIONS
@OVERWRITE
def convert(
    recording: Path, targets: tuple[Path, ...], *, directions: bool, overwrite: bool
) -> None:
    """Write a .rec recording in other formats, by the files' endings."""
    from hil_emulator.commands import convert as command

    command.convert(recording, targets, directions=directions, overwrite=overwrite)


COMMANDS = (run, ctl, demo, panel, replay, plot, convert)
