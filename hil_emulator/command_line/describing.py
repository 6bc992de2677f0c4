"""Commands that describe a machine, check the description and export it."""

from pathlib import Path

import click

from hil_emulator.command_line.interview import Interview
from hil_emulator.command_line.kinds import FILES, OVERWRITE, NewFile, Output, OutputStem


@click.command()
@click.option("--copy", "name", help="Copy this file, and the files that it names.")
@click.option(
    "--out",
    type=Output(is_folder=True),
    default=".",
    help="Folder for the copies; default: the present one.",
)
@OVERWRITE
def configs(name: str | None, out: Path, *, overwrite: bool) -> None:
    """List the configurations, scenarios and EDS of the package; copy one.

    A name can replace a file: hil-emulator run hyq_knee spring_load
    """
    from hil_emulator.commands import configs as command

    if name is None:
        command.listing()
    else:
        command.copy(name, out, overwrite=overwrite)


@click.command(cls=Interview)
@click.argument("file", type=Output(), default="machine.toml")
@click.option("--yes", is_flag=True, help="Do not ask: use defaults for all that no option states.")
@OVERWRITE
@click.option("--valves", is_flag=True, help="Only list the library of valves.")
def init(file: Path, *, yes: bool, overwrite: bool, valves: bool, **answers: str | None) -> None:
    """Write the configuration of your own machine, FILE, with the EDS of its node.

    The command asks for the machine's data. Every question is also an option.
    """
    from hil_emulator.commands import init as command

    if valves:
        command.list_valves()
        return
    given = {name: answer for name, answer in answers.items() if answer is not None}
    command.init(file, given, ask=not yes, overwrite=overwrite)


@click.command()
@FILES
def check(files: tuple[Path, ...]) -> None:
    """Validate a configuration; print its binding, PDO map and bus load."""
    from hil_emulator.commands import check as command

    command.check(files)


@click.command()
@click.argument("what", type=click.Choice(["configuration", "machine"]), default="configuration")
@click.option("--out", type=NewFile(), help="File to write.")
@OVERWRITE
def schema(what: str, out: Path | None, *, overwrite: bool) -> None:
    """Write the JSON Schema of a configuration, or of a machine of several actuators.

    A TOML editor uses it for a file that begins with "#:schema" and its path.
    """
    from hil_emulator.commands import schema as command

    command.schema(what, out, overwrite=overwrite)


@click.command()
@FILES
@click.option(
    "--out",
    type=Output(is_folder=True),
    default="export",
    show_default=True,
    help="Folder for the files.",
)
@OVERWRITE
def export(files: tuple[Path, ...], out: Path, *, overwrite: bool) -> None:
    """Write EDS and DCF of each node and a DBC of the bus."""
    from hil_emulator.commands import export as command

    command.export(files, out, overwrite=overwrite)


@click.command("export-fmu")
@FILES
@click.option("--out", type=OutputStem(), help="File to write, such as knee.fmu.")
@OVERWRITE
@click.option(
    "--fmi", type=click.Choice(["2", "3"]), default="3", show_default=True, help="Version of FMI."
)
@click.option("--c-only", is_flag=True, help="One .h and one .c, without FMI.")
@click.option("--float32", is_flag=True, help="With --c-only: compute with float.")
@click.option("--all-effects", is_flag=True, help="Include effects that are off.")
@click.option("--native", is_flag=True, help="Compile for this system only; quick.")
def export_fmu(
    files: tuple[Path, ...], out: Path | None, fmi: str, *, c_only: bool, float32: bool,
    all_effects: bool, native: bool, overwrite: bool,
) -> None:  # fmt: skip
    """Write plant and sensors as an FMU for co-simulation, or as C."""
    from hil_emulator.commands import export_fmu as command

    command.export_fmu(
        files,
        out,
        int(fmi),
        c_only=c_only,
        single=float32,
        every_effect=all_effects,
        native=native,
        overwrite=overwrite,
    )


COMMANDS = (configs, init, check, schema, export, export_fmu)
