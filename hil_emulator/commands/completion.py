"""`hil-emulator completion`: what a shell needs to complete commands, options and names."""

import click
from click.shell_completion import get_completion_class

_PROGRAM = "hil-emulator"
_VARIABLE = "_HIL_EMULATOR_COMPLETE"
"""By which the shell asks, as click derives it from the program's name."""


def completion(program: click.Command, shell: str) -> None:
    """Print the script of a shell.

    Args:
        program: whose commands are completed.
        shell: "bash", "zsh" or "fish".

    """
    found = get_completion_class(shell)
    assert found is not None
    script = found(program, {}, _PROGRAM, _VARIABLE)
    click.echo(script.source_template % script.source_vars())
