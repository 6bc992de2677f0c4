"""`hil-emulator convert`: a recording in other formats."""

from collections.abc import Sequence
from pathlib import Path

import click

from hil_emulator.commands.waiting import waiting
from hil_emulator.platform.paths import near
from hil_emulator.recording.exports import export


def convert(recording: Path, targets: Sequence[Path]) -> None:
    """Write a recording in the formats that the files' endings say.

    Raises:
        UserError: if it cannot be read, or a file cannot be written.

    """
    for target in targets:
        with waiting(f"convert to {target.suffix}", [recording]):
            export(recording, target)
        click.echo(f"written   {near(target)}")
