"""Recording from the panel: what comes from the loop goes on to a writer's process, as it is."""

import queue
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError, brief
from hil_emulator.platform.helper_process import report
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording import journal
from hil_emulator.recording.exports import check_file
from hil_emulator.recording.journal import EntryKind
from hil_emulator.recording.writer import start_writer

_PAUSE_S = 0.25  # without an entry, until the writer is looked at (assumed)


class Tape:
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
        self._writer = start_writer([file], header)
        self._waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._carrier = threading.Thread(target=self._carry, daemon=True)
        self._carrier.start()

    def take(self, kind: int, payload: bytes) -> None:
        """Take an entry; of a row, what a recording has."""
        if kind == EntryKind.ROW:
            payload = payload[: self._width]
        self._waiting.put(journal.entry(EntryKind(kind), payload))

    @property
    def failed(self) -> bool:
        """Whether the recording has ended, or has lost ticks, before it was stopped."""
        return bool(self._writer.failures)

    def close(self) -> None:
        """Write the rest, and wait until the file is whole."""
        self._waiting.put(b"")
        self._carrier.join()

    def _carry(self) -> None:
        """Hand entries to the writer until an empty one comes; report the writer's failures."""
        supervisor = Supervisor(report)
        supervisor.watch(self._writer)
        while (entry := self._next()) != b"":
            if entry:
                self._writer.write(entry)
            supervisor.look()
        self._writer.close()
        for failure in self._writer.look():
            report(failure)

    def _next(self) -> bytes | None:
        """Return the next entry; None if no entry comes for a while."""
        try:
            return self._waiting.get(timeout=_PAUSE_S)
        except queue.Empty:
            return None
