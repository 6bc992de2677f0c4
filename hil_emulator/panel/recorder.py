"""Recording from the panel: the loop's entries are passed to a writer process."""

import queue
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_emulator.errors import UserError, brief
from hil_emulator.platform.helper_process import report
from hil_emulator.platform.supervisor import Supervisor
from hil_emulator.recording import journal
from hil_emulator.recording.exports import check_recording
from hil_emulator.recording.journal import EntryKind
from hil_emulator.recording.writer import start_writer

_PAUSE_S = 0.25  # without an entry, until the writer is looked at (assumed)


class PanelRecorder:
    """One recording, from now until it is stopped.

    The loop takes no part: rows and frames come from the shared memory.

    Args:
        file: to write; a name without a folder, for the folder in which the emulator runs.
        header: of a recording.

    Raises:
        UserError: for a name with a folder, or a file that exists or cannot be written.

    """

    def __init__(self, file: Path, header: Mapping[str, Any]) -> None:
        if file.name != str(file) or file.name.startswith("."):
            raise UserError(f"{brief(str(file))}: name a file, without a folder")
        check_recording([file], way_out="choose another name")
        self.file = file
        self._width = 8 * len(header["columns"])
        self._writer = start_writer([file], header)
        self._waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._carrier = threading.Thread(target=self._carry, daemon=True)
        self._carrier.start()

    def take(self, kind: int, payload: bytes) -> None:
        """Record an entry; of a row, the columns of a recording."""
        if kind == EntryKind.ROW:
            payload = payload[: self._width]
        self._waiting.put(journal.entry(EntryKind(kind), payload))

    @property
    def failed(self) -> bool:
        """Whether the recording has ended, or has lost ticks, before it was stopped."""
        return bool(self._writer.failures)

    def close(self) -> None:
        """Write the rest, and wait until the file is complete."""
        self._waiting.put(b"")
        self._carrier.join()

    def _carry(self) -> None:
        """Pass entries to the writer until an empty one comes; report the writer's failures."""
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
