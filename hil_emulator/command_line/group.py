"""The group of all commands: their order, their help, and how each ends."""

import re
import sys
from typing import Any

import click

from hil_emulator.command_line.examples import EXAMPLES, GROUPS
from hil_emulator.errors import UserError, brief, did_you_mean

INTERRUPTED = 130
"""Exit code after Ctrl-C, as a shell gives it: 128 and the signal's number."""

_CUT_OFF = "data ended too early; a file was cut off or is empty, or a process ended that sent data"
"""Message for an end of data that the reader of a file did not expect."""


class Commands(click.Group):
    """A group that prints a `UserError` as one message and ends with its exit code.

    The same holds for an effect of the user that numba cannot compile. It is noticed only when the
    model is compiled, in any command.
    """

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Add a command, with an example at the beginning of its help."""
        super().add_command(cmd, name)
        example = EXAMPLES[name or str(cmd.name)]
        text = cmd.format_help_text

        def with_example(ctx: click.Context, formatter: click.HelpFormatter) -> None:
            formatter.write(f"\nExample: {example}\n")
            text(ctx, formatter)

        cmd.format_help_text = with_example  # type: ignore[method-assign]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands in groups, each with its whole first sentence."""
        width = max(map(len, EXAMPLES))
        for group, names in GROUPS.items():
            rows = [
                (f"{name:<{width}}", self.commands[name].get_short_help_str(sys.maxsize))
                for name in names
            ]
            with formatter.section(group):
                formatter.write_dl(rows)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command and its arguments; the error for a wrong name suggests one."""
        if args[0] not in self.commands and not args[0].startswith("-"):
            ctx.fail(f"no command '{brief(args[0])}'{did_you_mean(args[0], self.commands)}")
        return super().resolve_command(ctx, args)

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
        except EOFError as error:  # click would print "Aborted!", as after Ctrl-C
            click.echo(f"hil-emulator: {_CUT_OFF}{f': {error}' if str(error) else ''}", err=True)
            ctx.exit(UserError.exit_code)
        except Exception as error:
            if not type(error).__module__.startswith("numba."):
                raise
            click.echo(f"hil-emulator: {_uncompilable(str(error))}", err=True)
            ctx.exit(UserError.exit_code)


def _uncompilable(message: str) -> str:
    """Return numba's reason why it cannot compile a law, without the call stack."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    reasons = (x for x in lines if not x.startswith(("Failed in", "During:", "File ", "def ", ">")))
    place = re.search(r'File "([^"]*)", line (\d+)', message)
    where = f"{place[1]}, line {place[2]}: " if place else ""
    return (
        f"{where}an effect cannot be compiled: {next(reasons, lines[0])}; a law takes numbers and "
        "calls nothing but math"
    )
