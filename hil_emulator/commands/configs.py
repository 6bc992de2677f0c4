"""`hil-emulator configs`: what comes with the package, and copies of it."""

from pathlib import Path

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.platform import packaged
from hil_emulator.platform.paths import near


def listing() -> None:
    """Print every file that comes with the package, by the name that stands for it."""
    purposes = list(packaged.Purpose)
    files = sorted(
        packaged.packaged().items(), key=lambda f: purposes.index(packaged.purpose_of(f[1]))
    )
    rows = [(packaged.purpose_of(file), name, packaged.summary(file)) for name, file in files]
    click.echo(text_table(("kind", "name", "what it is"), rows))
    click.echo("\nA name does in place of a file; --copy NAME puts one here, to be changed.")


def copy(name: str, folder: Path, *, overwrite: bool = False) -> None:
    """Copy one into a folder, with all that it names.

    Raises:
        UserError: for an unknown name, or files that exist or cannot be written.

    """
    for file in packaged.copy(name, folder, overwrite=overwrite):
        click.echo(near(file))
