"""`hil-emulator completion`: completion of commands, options and names in a shell."""

import click
from click.shell_completion import get_completion_class

_PROGRAM = "hil-emulator"
_VARIABLE = "_HIL_EMULATOR_COMPLETE"
"""Variable by which the shell requests completions; click derives it from the program's name."""


def completion(program: click.Command, shell: str) -> None:
    """Print the script of a shell.

    Args:
        program: whose commands are completed.
        shell: "bash", "zsh" or "fish".

    """
    shell_class = get_completion_class(shell)
    assert shell_class is not None
    script = shell_class(program, {}, _PROGRAM, _VARIABLE)
    click.echo(script.source_template % script.source_vars())
