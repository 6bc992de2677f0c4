"""What the arguments of several commands share: kinds of values, and groups of options."""

import re
import sys
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from hil_emulator.commands.examples import EXAMPLES
from hil_emulator.errors import UserError


class PackagedFile(click.ParamType[Path]):
    """A file, or the name of one that comes with the package.

    Args:
        name: what it is, for the message.
        purposes: see `platform.packaged.Purpose`; all without any.

    """

    def __init__(self, name: str, *purposes: str) -> None:
        self.name = name
        self._purposes = purposes

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path of the file; whether it is one is found out when it is read."""
        from hil_emulator.platform.packaged import Purpose, found

        try:
            return found(str(value), *map(Purpose, self._purposes))
        except UserError as error:
            self.fail(str(error), param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the packaged names that begin so, and that files do as well."""
        from hil_emulator.platform.packaged import Purpose, packaged

        names = packaged(*map(Purpose, self._purposes))
        fitting = [CompletionItem(name) for name in names if name.startswith(incomplete)]
        return [*fitting, CompletionItem(incomplete, type="file")]


def _some(ctx: click.Context, param: click.Parameter, files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Ask for a file by what there is to choose from."""
    from hil_emulator.platform.packaged import Purpose, packaged, summary

    if files:
        return files
    known = [f"  {name:<14} {summary(file)}" for name, file in packaged(Purpose.MACHINE).items()]
    text = (f"name a configuration (TOML), or a machine that comes with the package:\n"
            f"{chr(10).join(known)}\n"
            f"`hil-emulator init` writes a configuration of your own machine.")  # fmt: skip
    raise click.UsageError(text, ctx)


CONFIGURATION = PackagedFile("configuration", "machine", "layer", "bench")
SCENARIO = PackagedFile("scenario", "scenario")

FILES = click.argument("files", metavar="CONFIG...", nargs=-1, type=CONFIGURATION, callback=_some)


INTERRUPTED = 130
"""Exit code after Ctrl-C, as a shell gives it: 128 and the signal's number."""


class Commands(click.Group):
    """A group that shows a `UserError` as one message and ends with its exit code.

    So does a law of the user's that cannot become machine code: that is found out only when the
    model is compiled, whichever command does it.
    """

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, with an example at the end of its help."""
        super().add_command(cmd, name)
        cmd.epilog = f"\b\nExample:\n  {EXAMPLES[name or str(cmd.name)]}"

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands by their whole first sentence: click cuts it off at the line's end."""
        rows = [
            (name, self.commands[name].get_short_help_str(sys.maxsize))
            for name in self.list_commands(ctx)
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def invoke(self, ctx: click.Context) -> Any:
        """Invoke a command."""
        try:
            return super().invoke(ctx)
        except UserError as error:
            click.echo(f"hil-emulator: {error}", err=True)
            ctx.exit(error.exit_code)
        except KeyboardInterrupt:
            click.echo("hil-emulator: interrupted", err=True)
            ctx.exit(INTERRUPTED)
        except Exception as error:
            if not type(error).__module__.startswith("numba."):
                raise
            click.echo(f"hil-emulator: {_uncompilable(str(error))}", err=True)
            ctx.exit(UserError.exit_code)


def _uncompilable(told: str) -> str:
    """Return what numba says of a law that it cannot compile, without the way to it."""
    lines = [line.strip() for line in told.splitlines() if line.strip()]
    reasons = (x for x in lines if not x.startswith(("Failed in", "During:", "File ", "def ", ">")))
    place = re.search(r'File "([^"]*)", line (\d+)', told)
    where = f"{place[1]}, line {place[2]}: " if place else ""
    return (
        f"{where}an effect cannot be compiled: {next(reasons, lines[0])}; a law takes numbers and "
        "calls nothing but math"
    )


class Duration(click.ParamType[float]):
    """A time with its unit."""

    name = "time"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the value in SI; fail where it is none."""
        from hil_emulator.units import to_si

        try:
            seconds = to_si(value, "s", "60 s")
        except ValueError as error:
            self.fail(str(error), param, ctx)
        if not 0 < seconds < float("inf"):
            self.fail(f'"{value}" is not a positive time', param, ctx)
        return seconds


class QuantityType(click.ParamType[float]):
    """A number with a unit."""

    def __init__(self, unit: str, example: str) -> None:
        self.name = example
        self._unit = unit

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the value in SI; fail where it is none."""
        from hil_emulator.units import to_si

        try:
            return to_si(value, self._unit, self.name)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class Interview(click.Command):
    """A command with an option for each question about a machine."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return what it takes; the questions are read only where they are needed."""
        from hil_emulator.machines.questions import QUESTIONS

        told = [click.Option([q.option], metavar="ANSWER", help=q.hint) for q in QUESTIONS]
        return [*self.params, *told, *super().get_params(ctx)[len(self.params) :]]


class Examination(click.Command):
    """A command whose `--validate` takes every file up to the next option."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse arguments: `--validate A B` is `--validate A --validate B`."""
        spread, taking = [], False
        for i, word in enumerate(args):
            if word == "--validate":
                taking = bool(args[i + 1 :]) and not args[i + 1].startswith("-")
                if not taking:
                    raise click.UsageError("--validate: name the held-out data behind it", ctx)
                continue
            taking &= not word.startswith("-")
            if taking and word.endswith(".toml"):
                raise click.UsageError(
                    f"{word}: --validate takes all files up to the next option; name CONFIG and "
                    "training data before it", ctx,
                )  # fmt: skip
            spread += ["--validate", word] if taking else [word]
        return super().parse_args(ctx, spread)


def recordings(function: Any) -> Any:
    """Add what `identify` and `gap` share."""
    for option in (
        click.option(
            "--cluster", default="",
            help="Address of a Dask scheduler in place of threads: each log is a task of its own. "
            "--jobs does not count then.",
        ),
        click.option(
            "--jobs", type=click.IntRange(1, 64), default=1, show_default=True,
            help="Threads of this process.",
        ),
        click.option("--out", type=click.Path(path_type=Path), help="Folder for the report."),
        click.option(
            "--rated-current", type=QuantityType("A", "10 mA"),
            help="What 100 % of a valve driver's set point are, where nothing states it.",
        ),
        click.option(
            "--channel", "channels", multiple=True, metavar="CHANNEL=NAME",
            help="What a channel is called in the data, such as position=CylPos.",
        ),
        click.option(
            "--columns", default="", metavar="NAME [UNIT],...",
            help='Columns of files without a header, such as "time [s],position [mm]".',
        ),
        click.option(
            "--node", "node_ids", multiple=True, type=click.IntRange(1, 127),
            help="Node-ID of an --eds file that states none.",
        ),
        click.option(
            "--eds", "sheets", multiple=True, type=click.Path(path_type=Path),
            help="EDS or DCF of a device in a CAN capture.",
        ),
        click.option(
            "--dbc", "databases", multiple=True, type=click.Path(path_type=Path),
            help="Database of the messages in a CAN capture; CONFIG's own nodes without it.",
        ),
        click.option(
            "--validate", multiple=True, type=click.Path(path_type=Path), metavar="DATA...",
            help="Held-out data: all files up to the next option.",
        ),
        click.argument(
            "files", metavar="CONFIG... DATA...", nargs=-1, required=True, type=CONFIGURATION,
        ),
    ):  # fmt: skip
        function = option(function)
    return function
