"""Durations of former jobs on this machine, to estimate that of the next one."""

import json
import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from hil_emulator import input_files
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import cache_folder

NAME = "times.json"
"""File in the cache folder: `[work, compiling]` by job."""

KEPT = 200
"""Number of stored jobs, the latest (assumed)."""


@dataclass(frozen=True)
class Usual:
    """Usual duration of a job; None if unknown.

    Attributes:
        work: without compilation [s].
        compiling: additional time if machine code has to be compiled [s].

    """

    work: float | None = None
    compiling: float | None = None

    def whole(self, *, compiled: bool) -> float | None:
        """Return the whole duration, with compilation or without [s]."""
        if self.work is None or (compiled and self.compiling is None):
            return None
        return self.work + (self.compiling or 0.0) * compiled


def job(what: str, files: Iterable[Path]) -> str:
    """Return the key of a job: its kind, and names and sizes of its files."""
    return " ".join([what, *(f"{f.name}:{f.stat().st_size}" for f in files if f.is_file())])


def recall(name: str) -> Usual:
    """Return the last duration of a job."""
    return Usual(*_all().get(name, ()))


def remember(name: str, work: float, compiling: float) -> None:
    """Store the duration of a job; without compilation, the former compilation time is kept."""
    stored = _all()
    before = Usual(*stored.pop(name, ()))
    stored[name] = [round(work, 2), round(compiling, 2) or before.compiling]
    latest = dict(list(stored.items())[-KEPT:])
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=folder, delete=False) as file:
            json.dump(latest, file, indent=1)
        os.replace(file.name, folder / NAME)
    except OSError:
        pass  # if it cannot be stored, the next job has no estimate


def _all() -> dict[str, list[float | None]]:
    """Return the stored durations; an empty dictionary if the file is missing or damaged."""
    try:
        stored = input_files.read_json(cache_folder() / NAME, input_files.PARAMETERS)
        return {
            str(name): [*map(_seconds, pair)] for name, pair in stored.items() if len(pair) == 2
        }
    except (UserError, OSError, ValueError, TypeError, AttributeError, OverflowError):
        return {}


def _seconds(value: object) -> float | None:
    return None if value is None else float(str(value))
