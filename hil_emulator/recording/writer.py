"""Starts the process that writes a recording."""

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
    """Return a process that writes the entries of its standard input into files.

    Its journal is there, and the header is in it.

    Args:
        files: what to write; see `exports`.
        header: of the recording.

    Raises:
        UserError: if the journal cannot be created, or has no room for the header.

    """
    kept = journal_file(files)
    writer = HelperProcess(
        [sys.executable, "-m", _PROGRAM, *map(str, files)],
        f"recording {', '.join(map(str, files))}",
        f"nothing more is recorded, {kept} holds what was written before; start the run again to "
        "record",
    )
    writer.write(journal.header_entry(header))
    trouble = writer.first_line()
    if trouble == "":
        return writer
    writer.close()
    raise UserError(f"recording: {trouble or ', '.join(writer.failures)}")
