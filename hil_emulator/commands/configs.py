"""`hil-emulator configs`: the files of the package, and copies of them."""

from pathlib import Path

import click

from hil_emulator.commands.text_table import text_table
from hil_emulator.platform import packaged
from hil_emulator.platform.paths import near


def listing() -> None:
    """Print every file of the package by its name."""
    purposes = list(packaged.Purpose)
    files = sorted(
        packaged.packaged().items(), key=lambda f: purposes.index(packaged.purpose_of(f[1]))
    )
    rows = [(packaged.purpose_of(file), name, packaged.summary(file)) for name, file in files]
    click.echo(text_table(("kind", "name", "what it is"), rows))
    click.echo("\nA name can replace a file; --copy NAME copies it here for changes.")


def copy(name: str, folder: Path, *, overwrite: bool = False) -> None:
    """Copy a packaged file into a folder, with all files that it names.

    Raises:
        UserError: for an unknown name, or files that exist or cannot be written.

    """
    for file in packaged.copy(name, folder, overwrite=overwrite):
        click.echo(near(file))
