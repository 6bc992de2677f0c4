"""Recordings: written by a separate process, readable after any end, replayed and drawn."""

from collections.abc import Sequence
from pathlib import Path

SUFFIX = ".rec"
"""Ending of a journal."""


def journal_of(files: Sequence[Path]) -> Path:
    """Return the file of the journal of a recording.

    It is the first `.rec` among the files. Without such a file, or if it exists and is replaced
    only at the end, the journal is named after the first file.
    """
    kept = next((file for file in files if file.suffix == SUFFIX), None)
    if kept is not None and not kept.exists():
        return kept
    return files[0].with_name(files[0].name + SUFFIX)
