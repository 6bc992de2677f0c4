"""Recording from the panel: what comes from the loop goes on to a writer's process, as it is."""

import contextlib
import queue
import subprocess
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError, brief
from hil_emulator.recording import journal
from hil_emulator.recording.exports import check_file
from hil_emulator.recording.journal import EntryKind
from hil_emulator.recording.writer_process import READY


class PanelRecorder:
    """One recording, from now until it is stopped.

    The loop has no part in it: rows and frames come out of the shared memory.

    Args:
        file: what to write; a name without a folder, of the folder in which the emulator runs.
        header: of a recording.

    Raises:
        UserError: for another place, a file that is there already, or one that cannot be written.

    """

    def __init__(self, file: Path, header: Mapping[str, Any]) -> None:
        if file.name != str(file) or file.name.startswith("."):
            raise UserError(f"{brief(str(file))}: name a file, without a folder")
        if file.exists():
            raise UserError(f"{file} is there already; choose another name")
        check_file(file)
        self.file = file
        self._width = 8 * len(header["columns"])
        command = [sys.executable, "-m", "hil_emulator.recording.writer_process", str(file)]
        self._writer = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._writer.stdout is not None
        with self._writer.stdout as ready:
            if ready.read(len(READY)) != READY:
                raise UserError(f"{file}: cannot be written")
        self._waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._waiting.put(journal.header_entry(header))
        self._carrier = threading.Thread(target=self._carry, daemon=True)
        self._carrier.start()

    def take(self, kind: int, payload: bytes) -> None:
        """Take an entry; of a row, what a recording has."""
        if kind == EntryKind.ROW:
            payload = payload[: self._width]
        self._waiting.put(journal.entry(EntryKind(kind), payload))

    def close(self) -> None:
        """Write the rest, and wait until the file is whole."""
        self._waiting.put(b"")
        self._carrier.join()
        self._writer.wait()

    def _carry(self) -> None:
        """Hand entries to the writer, until an empty one comes."""
        assert self._writer.stdin is not None
        with contextlib.suppress(BrokenPipeError), self._writer.stdin as pipe:
            while entry := self._waiting.get():
                pipe.write(entry)
