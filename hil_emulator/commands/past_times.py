"""How long jobs took on this machine, for those who wait for the next one."""

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
"""Jobs that are remembered, the latest (assumed)."""


@dataclass(frozen=True)
class Usual:
    """How long a job takes; None where nobody knows.

    Attributes:
        work: while nothing is compiled [s].
        compiling: what that adds where machine code has to be made first [s].

    """

    work: float | None = None
    compiling: float | None = None

    def whole(self, *, compiled: bool) -> float | None:
        """Return the time from begin to end, with compilation or without [s]."""
        if self.work is None or (compiled and self.compiling is None):
            return None
        return self.work + (self.compiling or 0.0) * compiled


def job(what: str, files: Iterable[Path]) -> str:
    """Return what a job is remembered by: the same work on files of the same name and size."""
    return " ".join([what, *(f"{f.name}:{f.stat().st_size}" for f in files if f.is_file())])


def recall(name: str) -> Usual:
    """Return how long a job took last."""
    return Usual(*_all().get(name, ()))


def remember(name: str, work: float, compiling: float) -> None:
    """Keep how long a job took; without compilation, what that took before stays known."""
    known = _all()
    before = Usual(*known.pop(name, ()))
    known[name] = [round(work, 2), round(compiling, 2) or before.compiling]
    latest = dict(list(known.items())[-KEPT:])
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=folder, delete=False) as file:
            json.dump(latest, file, indent=1)
        os.replace(file.name, folder / NAME)
    except OSError:
        pass  # who cannot keep it waits without knowing


def _all() -> dict[str, list[float | None]]:
    """Return what is remembered; nothing where the file is missing or damaged."""
    try:
        found = input_files.read_json(cache_folder() / NAME, input_files.PARAMETERS)
        return {str(name): [*map(_seconds, pair)] for name, pair in found.items() if len(pair) == 2}
    except (UserError, OSError, ValueError, TypeError, AttributeError, OverflowError):
        return {}


def _seconds(value: object) -> float | None:
    return None if value is None else float(str(value))
