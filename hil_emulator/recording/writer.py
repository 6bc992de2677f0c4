"""The start of the process that writes a recording."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError
from hil_emulator.platform.helper_process import HelperProcess
from hil_emulator.recording import journal
from hil_emulator.recording.writer_process import journal_file

_PROGRAM = "hil_emulator.recording.writer_process"


def start_writer(files: Sequence[Path], header: Mapping[str, Any]) -> HelperProcess:
    """Start a process that writes the entries of its standard input into files.

    When this returns, the journal exists and its first block is written.

    Args:
        files: what to write; see `exports`.
        header: of the recording.

    Raises:
        UserError: if the journal cannot be created, or the disk has no room for the first block.

    """
    kept = journal_file(files)
    writer = HelperProcess(
        [sys.executable, "-m", _PROGRAM, *map(str, files)],
        f"recording {', '.join(map(str, files))}",
        f"nothing more is recorded, {kept} holds what was written before; start another recording",
    )
    writer.write(journal.header_entry(header))
    reason = writer.first_line()
    if reason == "":
        return writer
    writer.close()
    raise UserError(f"recording: {reason}" if reason else "\n".join(writer.failures))
