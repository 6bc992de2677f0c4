"""The start of the process that writes a recording."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import HelperProcess
from hil_emulator.recording import journal, journal_of
from hil_emulator.recording.writer_process import OVERWRITE

_PROGRAM = "hil_emulator.recording.writer_process"


def start_writer(
    files: Sequence[Path], header: Mapping[str, Any], *, overwrite: bool = False
) -> HelperProcess:
    """Start a process that writes the entries of its standard input into files.

    When this returns, the journal exists and its first block is written.

    Args:
        files: to write; see `exports`.
        header: of the recording.
        overwrite: whether existing files are replaced, at the end.

    Raises:
        UserError: if the journal cannot be created, or the disk is full.

    """
    kept = journal_of(files)
    writer = HelperProcess(
        [sys.executable, "-m", _PROGRAM, *[OVERWRITE] * overwrite, *map(str, files)],
        f"recording {', '.join(map(str, files))}",
        f"recording has stopped, {kept} holds the data until then; start another recording",
    )
    writer.write(journal.header_entry(header))
    reason = writer.first_line()
    if reason == "":
        return writer
    writer.close()
    raise UserError(f"recording: {reason}" if reason else "\n".join(writer.failures))
