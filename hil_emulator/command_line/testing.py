"""Commands that test: controllers by scenarios and faults, devices by their standard."""

from pathlib import Path
from typing import Any

import click

from hil_emulator.command_line.kinds import OVERWRITE, ROLE, SCENARIO, NewFile, Output


@click.command("faults")
def list_faults() -> None:
    """Print the kinds of faults with their targets and parameters."""
    from hil_emulator.commands import faults as command

    command.faults()


@click.command()
@click.argument("files", metavar="SCENARIO...", nargs=-1, required=True, type=SCENARIO)
@click.option(
    "--jobs", "--workers", "workers", type=click.IntRange(1),
    help="Processes; default: one per core.",
)  # fmt: skip
@click.option(
    "--cluster", default="", help="Address of a Dask scheduler, which replaces processes."
)
@click.option("--junit", type=NewFile(), help="Write JUnit XML.")
@click.option("--html", "page", type=NewFile(), help="Write one HTML page.")
@click.option("--record", type=Output(is_folder=True), help="Folder for recordings.")
@ROLE
@OVERWRITE
@click.pass_context
def scenario(
    ctx: click.Context,
    /,
    files: tuple[Path, ...],
    workers: int | None,
    cluster: str,
    record: Path | None,
    role: Any,
    **reports: Any,
) -> None:
    """Run scenarios in lock-step; exit code 1 if an expectation is not met, 2 if one cannot run.

    To play a scenario against your controller on a bus, use `hil-emulator run --scenario`.
    """
    import os

    from hil_emulator.commands import scenario as command

    count = workers or os.cpu_count() or 1
    ctx.exit(command.scenario(files, count, cluster, command.Reports(**reports), record, role))


@click.command()
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
    help="After all cases send N random frames, then run all cases again.",
)
@click.option("--html", type=NewFile(), help="Write the report as an HTML page.")
@OVERWRITE
def conformance(
    can: str, can_options: tuple[str, ...], node: int, eds: Path,
    cases: tuple[str, ...], storm: int, *, self_starting: bool, **page: Any,
) -> None:  # fmt: skip
    """Test whether a CANopen device conforms to CiA 301; exit code 1 if a case fails.

    The device is reset before each case and its parameters are written, so no machine may be
    attached. Its parameters are restored in the end. No other NMT master may be on the bus.
    """
    from hil_emulator.commands import conformance as command

    passed = command.conformance(
        can,
        can_options,
        node,
        eds,
        cases,
        storm,
        command.Page(page["html"], page["overwrite"]),
        self_starting=self_starting,
    )
    raise SystemExit(not passed)


COMMANDS = (list_faults, scenario, conformance)
