"""Parameters of `identify` and `gap`: recordings, and statements about them."""

from pathlib import Path
from typing import Any

import click

from hil_emulator.command_line.kinds import CONFIGURATION, OVERWRITE, Output, QuantityType


class Examination(click.Command):
    """A command whose `--validate` takes every file up to the next option."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse arguments: `--validate A B` is `--validate A --validate B`."""
        spread, taking = [], False
        for i, word in enumerate(args):
            if word == "--validate":
                taking = bool(args[i + 1 :]) and not args[i + 1].startswith("-")
                if not taking:
                    raise click.UsageError("--validate: name the held-out data after it", ctx)
                continue
            taking &= not word.startswith("-")
            if taking and word.endswith(".toml"):
                raise click.UsageError(
                    f"{word}: --validate takes all files up to the next option; name CONFIG and "
                    "training data before it", ctx,
                )  # fmt: skip
            spread += ["--validate", word] if taking else [word]
        return super().parse_args(ctx, spread)


_RUNNING = (
    click.option(
        "--cluster", default="",
        help="Address of a Dask scheduler, which replaces threads (--jobs).",
    ),
    click.option(
        "--jobs", type=click.IntRange(1, 64), default=1, show_default=True,
        help="Threads of this process.",
    ),
    OVERWRITE,
    click.option("--out", type=Output(is_folder=True), help="Folder for the report."),
)  # fmt: skip
"""How the examination runs, and where its report goes."""

_TABLES = (
    click.option(
        "--rated-current", type=QuantityType("A", "10 mA"),
        help='Current at 100 % or full scale of the set point, such as "10 mA", where no file '
        "states it.",
    ),
    click.option(
        "--full-scale", type=QuantityType("V", "10 V"),
        help='Set point at the rated current, such as "10 V", if it is logged in volts.',
    ),
    click.option(
        "--set-points", type=click.Choice(["held", "moves"]),
        help="Course of the current between the rows of a log slower than the controller; "
         "by default estimated from the readings.",
    ),
    click.option(
        "--current-acts", type=click.Choice(["after", "before"]),
        help="Whether the current in a row acts after the readings of that row or acted before "
        "them, if no file states it; by default estimated from the readings.",
    ),
    click.option(
        "--channel", "channels", multiple=True, metavar="CHANNEL=NAME [UNIT]",
        help='Name of a channel in the data, such as "position=CylPos [mm]", with its unit if '
        "the data have no units.",
    ),
    click.option(
        "--columns", default="", metavar="NAME [UNIT],...",
        help='Columns of files without a header, such as "time [s],position [mm]".',
    ),
)  # fmt: skip
"""What the columns of a log mean."""

_FILES = (
    click.option(
        "--node", "node_ids", multiple=True, type=click.IntRange(1, 127),
        help="Node-ID of an --eds file without a node-ID.",
    ),
    click.option(
        "--eds", "sheets", multiple=True, type=click.Path(path_type=Path),
        help="EDS or DCF of a device in a CAN capture.",
    ),
    click.option(
        "--bus", metavar="CHANNEL",
        help="Channel of a CAN capture of several, such as 1 or can0.",
    ),
    click.option(
        "--dbc", "databases", multiple=True, type=click.Path(path_type=Path),
        help="Database of the messages in a CAN capture; default: the nodes of CONFIG.",
    ),
    click.option(
        "--validate", multiple=True, type=click.Path(path_type=Path), metavar="DATA...",
        help="Held-out data: all files up to the next option.",
    ),
    click.argument(
        "files", metavar="CONFIG... DATA...", nargs=-1, required=True, type=CONFIGURATION,
    ),
)  # fmt: skip
"""What the frames of a capture mean, and which files are examined."""


def recordings(function: Any) -> Any:
    """Add the parameters that `identify` and `gap` share."""
    for option in (*_RUNNING, *_TABLES, *_FILES):
        function = option(function)
    return function
