"""The file recorder: passes every tick to a separate process, and never waits for it."""

import contextlib
import os
import sys
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.platform.helper_process import HelperFailedError
from hil_emulator.recording import journal
from hil_emulator.recording.exports import check_recording
from hil_emulator.recording.journal import EntryKind
from hil_emulator.recording.pre_trigger import Capture
from hil_emulator.recording.writer import start_writer
from hil_emulator.signals.columns import Readings, columns, fill_row

_TICKS_PER_WRITE = 25  # ticks per system call; 25 ms at 1 kHz (assumed)
_PIPE_BYTES = 1 << 20  # what Linux grants without privileges
_SET_PIPE_SIZE = 1031  # F_SETPIPE_SZ of <linux/fcntl.h>


class FileRecorder:
    """Writes a recording through a process of its own.

    A slow disk does not delay the loop, and the recording survives the end of this process.

    Args:
        files: to write; see `exports`.
        header: see `header.header`.
        capture: delays ticks until its condition holds, if there is one.
        overwrite: whether existing files are replaced, at the end.

    Attributes:
        ticks: number of passed ticks.
        writer: the process.

    Raises:
        UserError: for a file that exists or cannot be written.

    """

    def __init__(
        self, files: Sequence[Path], header: Mapping[str, Any], capture: Capture | None = None, *,
        overwrite: bool = False,
    ) -> None:  # fmt: skip
        check_recording(files, overwrite=overwrite)
        self._row = np.empty(len(columns()))
        self._capture = capture
        self._tick = bytearray()  # this tick so far
        self._buffer = bytearray()
        self._unsent: deque[bytes] = deque()
        self.ticks = 0
        self.writer = start_writer(files, header, overwrite=overwrite)
        self._pipe = self.writer.input
        os.set_blocking(self._pipe, False)
        _widen(self._pipe)

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Record a tick."""
        fill_row(self._row, now_ns, plant, measured)
        self._tick += journal.entry(EntryKind.ROW, self._row.tobytes())
        if self._capture is None:
            self._buffer += self._tick
        else:
            self._buffer += self._capture.passed(now_ns, self._row, bytes(self._tick))
        self._tick.clear()
        self.ticks += 1
        if self.ticks % _TICKS_PER_WRITE == 0:
            self._flush()

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Take frames."""
        self._tick += journal.bus_entry(now_ns, frames, sent=sent)

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Record an action on the rig."""
        self._tick += journal.event_entry(now_ns, what)

    def close(self) -> None:
        """Write the rest and wait until all files are written; without a tick, no file is.

        Raises:
            HelperFailedError: if a file could not be written completely.

        """
        os.set_blocking(self._pipe, True)
        if not self.ticks:
            self._buffer += journal.event_entry(0, journal.NOT_BEGUN)
        self._flush()
        self.writer.close()
        if self.writer.failures:
            raise HelperFailedError("\n".join(self.writer.failures))

    def _flush(self) -> None:
        """Write as much as the pipe takes, and keep the rest."""
        self._unsent.append(bytes(self._buffer))
        self._buffer.clear()
        try:
            while self._unsent:
                first = self._unsent[0]
                written = os.write(self._pipe, first)
                if written == len(first):
                    self._unsent.popleft()
                else:
                    self._unsent[0] = first[written:]
        except BlockingIOError:
            pass
        except BrokenPipeError:
            self._unsent.clear()  # the writer has ended; the supervisor watches its process


def _widen(pipe: int) -> None:
    """Enlarge the pipe to about a second of ticks, if the system permits it."""
    if sys.platform.startswith("linux"):
        import fcntl

        with contextlib.suppress(OSError):
            fcntl.fcntl(pipe, _SET_PIPE_SIZE, _PIPE_BYTES)
