"""The program `hil-emulator`: all its commands."""

import click

from hil_emulator import __version__
from hil_emulator.command_line import describing, examining, identifying, running, testing
from hil_emulator.command_line.group import Commands


@click.group(cls=Commands)
@click.version_option(__version__, prog_name="hil-emulator")
def main() -> None:
    """Emulate a hydraulic actuator as a CANopen device."""


@main.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the script by which a shell completes commands, options and names.

    bash and zsh evaluate it in ~/.bashrc or ~/.zshrc; fish keeps it as
    ~/.config/fish/completions/hil-emulator.fish.
    """
    from hil_emulator.commands import completion as command

    command.completion(main, shell)


for room in (running, describing, examining, testing, identifying):
    for command in room.COMMANDS:
        main.add_command(command)

if __name__ == "__main__":
    main()
