"""Signals and sensor readings over time, kept in memory and written after the run."""

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.model.actuator import INPUTS, SIGNALS
from hil_emulator.model.plant import Plant
from hil_emulator.model.sensors import CHANNELS

_CHUNK = 4096  # rows allocated at once

MODEL = "model."
"""Prefix of the model's own signals, which no sensor adds its errors to."""


@cache
def columns() -> dict[str, str]:
    """Return the columns of a recording, name to SI unit.

    Time, set points, then what the sensors report, then the model's own signals.
    """
    return (
        {"time": "s"}
        | {q.name: q.unit for q in INPUTS}
        | {c.name: c.unit for c in CHANNELS}
        | {MODEL + q.name: q.unit for q in SIGNALS}
    )


class Tape(Protocol):
    """What the rig tells of each tick: into memory, or to another process."""

    def row(self, now_ns: int, plant: Plant, measured: Sequence[float]) -> None:
        """Keep set points, readings and signals at the end of a tick."""
        ...

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Keep frames that the emulator has received or sent."""
        ...

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Keep what was done to the rig."""
        ...


def fill_row(
    row: np.ndarray[Any, np.dtype[np.float64]], now_ns: int, plant: Plant, measured: Sequence[float]
) -> None:
    """Write a tick into a row of the width of `columns()`."""
    first = 1 + len(plant.input_vector)
    second = first + len(measured)
    row[0] = now_ns * 1e-9
    row[1:first] = plant.input_vector
    row[first:second] = measured
    row[second:] = plant.signal_vector


class Recorder:
    """Takes one row per tick, and the frames and interventions between the rows.

    Attributes:
        frames: time [ns], whether the emulator sent it, and frame, oldest first.
        events: time [ns] and description of what was done to the rig: faults, settings.

    """

    def __init__(self) -> None:
        self._width = len(columns())
        self._chunks: list[np.ndarray[Any, np.dtype[np.float64]]] = []
        self._filled = _CHUNK
        self.frames: list[tuple[int, bool, Frame]] = []
        self.events: list[tuple[int, dict[str, Any]]] = []

    def row(self, now_ns: int, plant: Plant, measured: Sequence[float]) -> None:
        """Keep the present set points, readings and signals."""
        if self._filled == _CHUNK:
            self._chunks.append(np.empty((_CHUNK, self._width)))
            self._filled = 0
        fill_row(self._chunks[-1][self._filled], now_ns, plant, measured)
        self._filled += 1

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Keep frames that the emulator has received or sent."""
        self.frames += [(now_ns, sent, frame) for frame in frames]

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Keep what was done to the rig."""
        self.events.append((now_ns, dict(what)))

    def table(self) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
        """Return the recording, column name to values over time."""
        if not self._chunks:
            return {name: np.empty(0) for name in columns()}
        rows = np.concatenate([*self._chunks[:-1], self._chunks[-1][: self._filled]])
        return {name: rows[:, i] for i, name in enumerate(columns())}


def check_file(file: Path) -> None:
    """Refuse a file that cannot be written, before the run.

    Raises:
        UserError: for an unknown ending or a folder that is not there.

    """
    if file.suffix not in _WRITERS:
        raise UserError(f"{file}: unknown ending; a recording ends in {' or '.join(_WRITERS)}")
    if not file.parent.is_dir():
        raise UserError(f"{file}: the folder {file.parent} does not exist; make it first")


def save(recorder: Recorder, file: Path, provenance: Mapping[str, str]) -> None:
    """Write a recording in the format of the file's ending.

    Args:
        recorder: what was recorded.
        file: where to; see `check_file`.
        provenance: what made the data, such as the configuration's digest.

    Raises:
        UserError: if the file cannot be written.

    """
    try:
        _WRITERS[file.suffix](recorder, file, provenance)
    except OSError as error:
        raise UserError(f"{file}: cannot be written: {error}") from None


def _save_csv(recorder: Recorder, file: Path, provenance: Mapping[str, str]) -> None:
    table = recorder.table()
    with file.open("w", newline="", encoding="utf-8") as out:
        out.writelines(f"# {key}: {value}\n" for key, value in provenance.items())
        writer = csv.writer(out)
        writer.writerow([f"{name} [{unit}]" for name, unit in columns().items()])
        for row in zip(*(values.tolist() for values in table.values()), strict=True):
            writer.writerow([f"{value:.9g}" for value in row])


def _save_npz(recorder: Recorder, file: Path, provenance: Mapping[str, str]) -> None:
    units = {"units": np.array(list(columns().items()))}
    origin = {"provenance": np.array(list(provenance.items()))}
    np.savez_compressed(file, **recorder.table(), **units, **origin)  # type: ignore[arg-type]


_WRITERS: dict[str, Callable[[Recorder, Path, Mapping[str, str]], None]] = {
    ".csv": _save_csv,
    ".npz": _save_npz,
}
