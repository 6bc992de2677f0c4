"""The command line: arguments only; each command lives in `hil_emulator.commands`."""

from pathlib import Path
from typing import Any

import click

from hil_emulator import __version__
from hil_emulator.commands.options import (
    CONFIGURATION,
    FILES,
    SCENARIO,
    Commands,
    Duration,
    Examination,
    Interview,
    QuantityType,
    recordings,
)
from hil_emulator.errors import UserError


@click.group(cls=Commands)
@click.version_option(__version__, prog_name="hil-emulator")
def main() -> None:
    """Emulate a hydraulic actuator as a CANopen device."""


@main.command()
@FILES
@click.option("--bus", metavar="INTERFACE:CHANNEL", help="Another bus, such as socketcan:vcan0.")
@click.option(
    "--clock",
    type=click.Choice(["wall", "lockstep", "follow-sync"]),
    default="wall",
    show_default=True,
)
@click.option("--duration", type=Duration(), help='Emulator time to run, such as "60 s".')
@click.option(
    "--record",
    type=click.Path(path_type=Path),
    multiple=True,
    help="File to write; its ending says the format: .rec .csv .blf ..., an unknown one lists all.",
)
@click.option("--trigger", help='Record only around a condition, such as "position > 60 mm".')
@click.option("--before", type=Duration(), default="5 s", help="How long before the trigger.")
@click.option("--after", type=Duration(), default="1 s", help="How long after the trigger.")
@click.option("--fault", "faults", multiple=True, help='TARGET KIND NAME=VALUE...; see "faults".')
@click.option("--port", type=click.IntRange(0, 65535), help="TCP port of the bus; 0: any free one.")
@click.option("--control", type=click.IntRange(0, 65535), help="Port of the remote control (ctl).")
@click.option("--panel", "panel", flag_value="full", help="Show it in a browser.")
@click.option("--panel-view-only", "panel", flag_value="view only", help="Nobody touches it there.")
def run(
    files: tuple[Path, ...],
    bus: str | None,
    clock: str,
    duration: float | None,
    record: tuple[Path, ...],
    faults: tuple[str, ...],
    **said: Any,
) -> None:
    """Run the emulator on its bus."""
    from hil_emulator.platform.lean_start import lean_start

    lean_start()
    from hil_emulator.commands import run as command

    operation = command.operation(said.pop("port"), said.pop("control"), said.pop("panel"))
    capture = command.capture(**said)
    command.run(files, bus, clock, duration, record, capture, faults, operation)


@main.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print what a shell needs to complete commands, options and names.

    bash and zsh evaluate it in ~/.bashrc or ~/.zshrc; fish keeps it as
    ~/.config/fish/completions/hil-emulator.fish.
    """
    from hil_emulator.commands import completion as command

    command.completion(main, shell)


@main.command("faults")
def list_faults() -> None:
    """Print what can be broken, and how."""
    from hil_emulator.commands import faults as command

    command.faults()


@main.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION)
@click.pass_context
def replay(ctx: click.Context, recording: Path, files: tuple[Path, ...]) -> None:
    """Feed a recorded controller's frames back; say where the response differs."""
    from hil_emulator.commands import replay as command

    ctx.exit(0 if command.replay(recording, files) else 1)


@main.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("signals", nargs=-1)
@click.option("--picture", type=click.Path(path_type=Path), help="File of the picture.")
def plot(recording: Path, signals: tuple[str, ...], picture: Path | None) -> None:
    """Draw signals of a recording."""
    from hil_emulator.commands import plot as command

    command.plot(recording, signals, picture)


@main.command()
@click.argument("path", metavar="RECORDING|FOLDER", type=click.Path(path_type=Path))
def panel(path: Path) -> None:
    """Show a recording (.rec), or the folder of `identify --out`, in a browser."""
    from hil_emulator.commands import panel as command

    command.panel(path)


@main.command()
@click.argument("files", metavar="SCENARIO...", nargs=-1, required=True, type=SCENARIO)
@click.option(
    "--jobs", "--workers", "workers", type=click.IntRange(1),
    help="Processes; all cores without it.",
)  # fmt: skip
@click.option("--cluster", default="", help="Address of a Dask scheduler in place of processes.")
@click.option("--junit", type=click.Path(path_type=Path), help="Write JUnit XML.")
@click.option("--html", "page", type=click.Path(path_type=Path), help="Write one HTML page.")
@click.option("--record", type=click.Path(path_type=Path), help="Folder for recordings.")
@click.pass_context
def scenario(
    ctx: click.Context,
    files: tuple[Path, ...],
    workers: int | None,
    cluster: str,
    junit: Path | None,
    page: Path | None,
    record: Path | None,
) -> None:
    """Run scenarios; exit code 1 if an expectation is not met, 2 if a scenario cannot run."""
    import os

    from hil_emulator.commands import scenario as command

    count = workers or os.cpu_count() or 1
    ctx.exit(command.scenario(files, count, cluster, junit, page, record))


@main.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.argument("targets", nargs=-1, required=True, type=click.Path(path_type=Path))
def convert(recording: Path, targets: tuple[Path, ...]) -> None:
    """Write a .rec recording in other formats, by the files' endings."""
    from hil_emulator.platform.paths import near
    from hil_emulator.recording import exports

    for target in targets:
        exports.export(recording, target)
        click.echo(f"written   {near(target)}")


@main.command(context_settings={"ignore_unknown_options": True})  # "-0.5 mA" is a value
@click.option("--port", type=click.IntRange(1, 65535), default=29537, show_default=True)
@click.argument("words", metavar="status|read|fault|end|set ...", nargs=-1)
def ctl(port: int, words: tuple[str, ...]) -> None:
    """Control an emulator that runs with --control."""
    from hil_emulator.commands import ctl as command

    command.ctl(port, words)


@main.command()
@click.option(
    "--picture",
    type=click.Path(path_type=Path, dir_okay=False, writable=True),
    default="hil-emulator-demo.png",
    show_default=True,
)
@click.pass_context
def demo(ctx: click.Context, picture: Path) -> None:
    """Run a controller against the emulator through CAN; needs nothing."""
    from hil_emulator.commands import demo as command

    ctx.exit(0 if command.demo(picture) else 1)


@main.command()
@click.option("--copy", "name", help="Copy this one with all that it names.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=".",
    help="Folder for the copies; the present one without it.",
)
def configs(name: str | None, out: Path) -> None:
    """List the configurations, scenarios and EDS that come with the package; copy one.

    Each may be named in place of a file: hil-emulator run hyq_knee spring_load
    """
    from hil_emulator.commands import configs as command

    if name is None:
        command.listing()
    else:
        command.copy(name, out)


@main.command()
@FILES
def check(files: tuple[Path, ...]) -> None:
    """Validate a configuration; print its binding, PDO map and bus load."""
    from hil_emulator.commands import check as command

    command.check(files)


@main.command(cls=Interview)
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False), default="machine.toml")
@click.option("--yes", is_flag=True, help="Ask nothing: usual answers to what no option gives.")
@click.option("--force", is_flag=True, help="Write over files that are there.")
@click.option("--valves", is_flag=True, help="Only list the library of valves.")
def init(file: Path, *, yes: bool, force: bool, valves: bool, **said: str | None) -> None:
    """Ask for a machine of your own and write its configuration, FILE, with the EDS of its node.

    Every question has an option, too.
    """
    from hil_emulator.commands import init as command

    if valves:
        command.list_valves()
        return
    given = {name: answer for name, answer in said.items() if answer is not None}
    command.init(file, given, ask=not yes, force=force)


@main.command()
@click.argument("what", type=click.Choice(["configuration", "machine"]), default="configuration")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="File to write.")
def schema(what: str, out: Path | None) -> None:
    """Write the JSON Schema of a configuration, or of a machine of several actuators.

    An editor of TOML completes and checks by it a file that begins with "#:schema" and its path.
    """
    from hil_emulator.commands import schema as command

    command.schema(what, out)


@main.command()
@FILES
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default="export",
    show_default=True,
    help="Folder for the files.",
)
def export(files: tuple[Path, ...], out: Path) -> None:
    """Write EDS and DCF of each node and a DBC of the bus."""
    from hil_emulator.commands import export as command

    command.export(files, out)


@main.command("export-fmu")
@FILES
@click.option("--out", type=click.Path(path_type=Path), help="File to write, such as knee.fmu.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="3", show_default=True)
@click.option("--c-only", is_flag=True, help="One .h and one .c, without FMI.")
@click.option("--float32", is_flag=True, help="With --c-only: compute with float.")
@click.option("--all-effects", is_flag=True, help="Bring effects that are off, too.")
def export_fmu(
    files: tuple[Path, ...], out: Path | None, fmi: str, *, c_only: bool, float32: bool,
    all_effects: bool,
) -> None:  # fmt: skip
    """Write plant and sensors as an FMU for co-simulation, or as C."""
    from hil_emulator.commands import export_fmu as command

    command.export_fmu(
        files, out, int(fmi), c_only=c_only, single=float32, every_effect=all_effects
    )


@main.command()
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION)
@click.option("--duration", type=Duration(), default="10 s", help="Of the wall-clock part.")
@click.option("--identify", type=Duration(), help='Instead: find an effect in "60 s" of data.')
@click.option(
    "--panel", is_flag=True, help="Instead: what the panel costs, by pages that are open."
)
@click.option("--effects", is_flag=True, help="Instead: what each effect costs that is off.")
@click.option("--json", "as_json", is_flag=True, help="For programs; microseconds.")
def bench(
    files: tuple[Path, ...], duration: float, identify: float | None, panel: bool, effects: bool,
    as_json: bool,
) -> None:  # fmt: skip
    """Measure the emulator's speed and punctuality on this machine."""
    from hil_emulator.commands import bench as command

    if effects:
        command.bench_effects(files, as_json)
        return
    command.bench(files, duration, identify, as_json, panel)


@main.command()
@click.argument("test")
@FILES
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default="characterisation",
    show_default=True,
    help="Folder for tables, pictures and the page.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Of the sensors' noise.")
def characterise(test: str, files: tuple[Path, ...], out: Path, seed: int | None) -> None:
    """Put the emulated actuator on a test bench; TEST is "all" or the name of one."""
    from hil_emulator.commands import characterise as command

    command.run(test, files, out, seed)


@main.command()
@FILES
@click.option(
    "--position", type=QuantityType("m", "40 mm"), help='Such as "40 mm"; else the start.'
)
@click.option("--current", type=QuantityType("A", "1 mA"), default="0 mA", help="0 mA: at rest.")
@click.option("--json", "as_json", is_flag=True, help="For programs; SI.")
@click.option(
    "--picture",
    type=click.Path(path_type=Path, dir_okay=False, writable=True),
    help="Draw the frequency responses.",
)
def linear(
    files: tuple[Path, ...],
    position: float | None,
    current: float,
    as_json: bool,
    picture: Path | None,
) -> None:
    """Linearise an actuator: S1's coefficients, poles and zeros, and the exact ones."""
    from hil_emulator.commands import linear as command

    command.run(files, position, current, as_json, picture)


@main.command()
@click.argument("files", metavar="[CONFIG]...", nargs=-1, type=CONFIGURATION)
@click.option("--json", "as_json", is_flag=True, help="Everything, for programs.")
def effects(files: tuple[Path, ...], as_json: bool) -> None:
    """Print the catalogue of physical effects, with those of a configuration's own files."""
    from hil_emulator.commands import effects as command

    command.effects(files, as_json)


def _meaning(said: dict[str, Any]) -> Any:
    from hil_emulator.api.logs import Meaning, pairs

    names = pairs(said.pop("channels"))
    headings = [cell.strip() for cell in said.pop("columns").split(",") if cell.strip()]
    return Meaning(names=names, headings=headings, **said)


@main.command(cls=Examination)
@recordings
@click.option("--only", multiple=True, metavar="EFFECT", help="Name none but these.")
@click.option("--exclude", multiple=True, metavar="EFFECT", help="Do not name these.")
@click.option(
    "--method",
    type=click.Choice(["search", "least-squares"]),
    default="search",
    help="least-squares: beside what the search finds, a plain fit of the same effects.",
)
def identify(
    files: tuple[Path, ...], validate: tuple[Path, ...], only: tuple[str, ...],
    exclude: tuple[str, ...], out: Path | None, jobs: int, cluster: str, **said: Any,
) -> None:  # fmt: skip
    """Name the physical effects that a recording shows and the configuration lacks."""
    from hil_emulator.commands import identify as command
    from hil_emulator.identify.session import Question

    question = Question(only, exclude, plain_fit=said.pop("method") == "least-squares")
    command.identify(files, validate, question, out, jobs, _meaning(said), cluster)


@main.command(cls=Examination)
@recordings
def gap(
    files: tuple[Path, ...], validate: tuple[Path, ...], out: Path | None, jobs: int, cluster: str,
    **said: Any,
) -> None:  # fmt: skip
    """Measure where a recording and the configuration disagree."""
    from hil_emulator.commands import identify as command
    from hil_emulator.identify.session import Question

    question = Question(search=False)
    command.identify(files, validate, question, out, jobs, _meaning(said), cluster)


@main.command()
@click.argument("name", required=False)
@click.option("--amplitude", type=QuantityType("m", "12 mm"), help="Largest deviation: 12 mm.")
@click.option("--duration", type=Duration(), help='How long, such as "2 s".')
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True)
@click.option(
    "--config", "configs", multiple=True, type=CONFIGURATION,
    help="The machine, for its stops and its valve.",
)  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), help="Stimulus file; NAME.csv without it.")
@click.option("--picture", type=click.Path(path_type=Path), help="Draw it.")
@click.option("--scenario", type=click.Path(path_type=Path), help="Write a scenario that plays it.")
def experiment(
    name: str | None, amplitude: float | None, duration: float | None, seed: int,
    configs: tuple[Path, ...], out: Path | None, picture: Path | None, scenario: Path | None,
) -> None:  # fmt: skip
    """Write the stimulus file of an experiment; without NAME, list what there is."""
    from hil_emulator.commands import experiment as command

    if name is None:
        command.catalogue(configs)
        return
    command.write(name, configs, amplitude, duration, seed, out, picture, scenario)


@main.command()
@click.argument("effects", nargs=-1)
@click.option("--size", "sizes", multiple=True, help="small, medium, large, or a value; one each.")
@click.option("--config", "configs", multiple=True, type=CONFIGURATION, help="The machine.")
@click.option("--seed", type=click.IntRange(min=0), help="The same machine again.")
@click.option("--surprise", is_flag=True, help="Draw an effect, and do not tell.")
@click.option("--duration", type=Duration(), help='Of each experiment, such as "3 s".')
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the practice ground.")
@click.option("--play", type=click.Path(path_type=Path), help="Record a stimulus file in --out.")
@click.option("--open", "opened", type=click.Path(path_type=Path), help="Reveal what is hidden.")
def hide(
    effects: tuple[str, ...], sizes: tuple[str, ...], out: Path | None, play: Path | None,
    opened: Path | None, **drawn: Any,
) -> None:  # fmt: skip
    """Make experiments with EFFECTs hidden in them, to practise on; "nothing" is one too."""
    from hil_emulator.commands import hide as command

    if opened is not None:
        command.reveal(opened)
        return
    if out is None:
        raise UserError("name the folder of the practice ground: --out FOLDER")
    if play is not None:
        command.play(play, out)
        return
    command.hide(effects, sizes or ("medium",), out=out, **drawn)


@main.command()
@click.option(
    "--can",
    default="socketcand:can0",
    metavar="INTERFACE:CHANNEL",
    show_default=True,
    help="Bus, such as socketcan:can0; the default is that of `run` on this machine.",
)
@click.option(
    "--can-option",
    "can_options",
    multiple=True,
    metavar="KEY=VALUE",
    help="Another argument of python-can's Bus, such as port=29536.",
)
@click.option("--node", required=True, type=click.IntRange(1, 127), help="Node-ID of the device.")
@click.option("--eds", required=True, type=click.Path(path_type=Path), help="Its EDS or DCF.")
@click.option("--case", "cases", multiple=True, help="A case or chapter, such as 2.7 or 3.")
@click.option("--self-starting", is_flag=True, help="It may enter OPERATIONAL without 0x1F80.")
@click.option(
    "--storm",
    type=click.IntRange(0),
    default=0,
    metavar="N",
    help="After all cases send N random frames, then put all cases again.",
)
@click.option("--html", type=click.Path(path_type=Path), help="Write the report as an HTML page.")
def conformance(
    can: str, can_options: tuple[str, ...], node: int, eds: Path,
    cases: tuple[str, ...], storm: int, html: Path | None, *, self_starting: bool,
) -> None:  # fmt: skip
    """Ask a CANopen device whether it conforms to CiA 301; exit code 1 if a case fails.

    The device is reset before each case and its parameters are written: no machine may hang on
    it. In the end it has the parameters that it had. Nothing else may be the bus's NMT master.
    """
    from hil_emulator.commands import conformance as command

    passed = command.conformance(
        can, can_options, node, eds, cases, storm, html, self_starting=self_starting
    )
    raise SystemExit(not passed)


if __name__ == "__main__":
    main()
