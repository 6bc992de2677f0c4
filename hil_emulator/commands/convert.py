"""`hil-emulator convert`: a recording in other formats."""

from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.commands.waiting import waiting
from hil_emulator.platform.paths import near
from hil_emulator.recording.exports import check_files, export


def convert(
    recording: Path, targets: Sequence[Path], *, directions: bool = False, overwrite: bool = False
) -> None:
    """Write a recording in the formats of the files' endings.

    Raises:
        UserError: if it cannot be read, or a file exists or cannot be written.

    """
    check_files(targets, overwrite=overwrite)
    endings = " ".join(target.suffix for target in targets)
    with waiting(f"convert to {endings}", [recording]):
        export(recording, *targets, overwrite=overwrite, directions=directions)
    for target in targets:
        click.echo(f"written   {near(target)}")
