"""Parts of a journal, without loading the whole file."""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.recording import journal
from hil_emulator.recording.header_shape import header_of_entry
from hil_emulator.recording.journal import EntryKind

_BATCH = 4096  # rows handled at once


def header_of(source: Path) -> dict[str, Any]:
    """Return a journal's header."""
    for kind, payload in journal.entries(source):
        if kind is EntryKind.HEADER:
            return header_of_entry(source, payload)
    raise UserError(f"{source}: empty; it ended before anything was written")


def batches(source: Path) -> Iterator[np.ndarray[Any, np.dtype[np.float64]]]:
    """Yield rows in batches, shape (rows, columns)."""
    width = len(header_of(source)["columns"])
    rows = (payload for kind, payload in journal.entries(source) if kind is EntryKind.ROW)
    while batch := list(itertools.islice(rows, _BATCH)):
        yield np.frombuffer(b"".join(batch)).reshape(-1, width)


def frames(source: Path) -> Iterator[tuple[int, bool, Frame]]:
    """Yield time [ns], whether the emulator sent it, and frame; oldest first."""
    for kind, payload in journal.entries(source):
        if kind is EntryKind.BUS:
            yield from journal.frames_of(payload)
