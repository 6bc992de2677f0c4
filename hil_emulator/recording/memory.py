"""The interface of recorders, and a recorder in memory."""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np

from hil_emulator.frame import Burst, Frame
from hil_emulator.model.plant import Plant
from hil_emulator.signals.columns import Readings, columns, fill_row

_CHUNK = 4096  # rows allocated at once


class Recorder(Protocol):
    """Receives every tick of a rig: into memory, or into another process."""

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Keep set points, readings and signals at the end of a tick."""
        ...

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Keep frames that the emulator has received or sent."""
        ...

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Keep an action on the rig."""
        ...


class MemoryRecorder:
    """Keeps one row per tick, and the frames and actions between the rows."""

    def __init__(self) -> None:
        self._width = len(columns())
        self._chunks: list[np.ndarray[Any, np.dtype[np.float64]]] = []
        self._filled = _CHUNK
        self._frames: list[tuple[int, bool, Frame]] = []
        self._unmade: list[tuple[int, bool, Iterable[Frame]]] = []
        self.events: list[tuple[int, dict[str, Any]]] = []

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Keep the present set points, readings and signals."""
        if self._filled == _CHUNK:
            self._chunks.append(np.empty((_CHUNK, self._width)))
            self._filled = 0
        fill_row(self._chunks[-1][self._filled], now_ns, plant, measured)
        self._filled += 1

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Keep frames that the emulator has received or sent."""
        lasting = frames if type(frames) in (Burst, list) else list(frames)
        self._unmade.append((now_ns, sent, lasting))

    @property
    def frames(self) -> list[tuple[int, bool, Frame]]:
        """Time [ns], whether the emulator sent it, and frame, oldest first."""
        for now_ns, sent, frames in self._unmade:
            self._frames += [(now_ns, sent, frame) for frame in frames]
        self._unmade.clear()
        return self._frames

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Keep an action on the rig."""
        self.events.append((now_ns, dict(what)))

    def rows(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the recording, shape (ticks, columns)."""
        if not self._chunks:
            return np.empty((0, self._width))
        return np.concatenate([*self._chunks[:-1], self._chunks[-1][: self._filled]])

    def table(self) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
        """Return the recording, column name to values over time."""
        rows = self.rows()
        return {name: rows[:, i] for i, name in enumerate(columns())}
