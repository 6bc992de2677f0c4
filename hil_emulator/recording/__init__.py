"""Recordings: written beside the loop, read after whatever ended it, replayed and drawn."""

from collections.abc import Sequence
from pathlib import Path

SUFFIX = ".rec"
"""Ending of a journal."""


def journal_of(files: Sequence[Path]) -> Path:
    """Return the file of the journal while a recording into some files is made.

    It is the first `.rec` among these files. Where no such file is asked for, or it exists and is
    replaced at the end only, the journal is named after the first file.
    """
    kept = next((file for file in files if file.suffix == SUFFIX), None)
    if kept is not None and not kept.exists():
        return kept
    return files[0].with_name(files[0].name + SUFFIX)
