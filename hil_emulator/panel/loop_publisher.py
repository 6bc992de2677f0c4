"""Publication of every tick for the panel: entries of a journal in shared memory."""

import time
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hil_emulator.frame import Frame
from hil_emulator.model.plant import Plant
from hil_emulator.panel.live_state import EXECUTION, LATENESS
from hil_emulator.panel.ring import RingWriter
from hil_emulator.recording import journal
from hil_emulator.recording.journal import EntryKind
from hil_emulator.signals.columns import Readings, columns, fill_row
from hil_emulator.simulation.loop import Timing


def published_columns() -> dict[str, str]:
    """Return the panel's columns, name to SI unit: those of a recording and of the loop."""
    return columns() | {LATENESS: "s", EXECUTION: "s"}


class LoopPublisher:
    """Publishes every tick like a recorder, with the columns of `published_columns`.

    Delay and duration are measured after the tick: a row has those of the tick before.

    Args:
        ring: written by the publisher.

    """

    def __init__(self, ring: RingWriter) -> None:
        self._ring = ring
        self._row = np.zeros(len(published_columns()))
        self._recorded = self._row[: len(columns())]
        self._tick = bytearray()
        self._punctual = self._row[len(columns()) :]

    def row(self, now_ns: int, plant: Plant, measured: Readings) -> None:
        """Publish a tick, with the frames and events before."""
        fill_row(self._recorded, now_ns, plant, measured)
        self._tick += journal.entry(EntryKind.ROW, self._row.tobytes())
        self._ring.write(self._tick, time.monotonic_ns())
        self._tick.clear()

    def bus(self, now_ns: int, frames: Iterable[Frame], *, sent: bool) -> None:
        """Keep frames for the end of the tick."""
        self._tick += journal.bus_entry(now_ns, frames, sent=sent)

    def event(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Keep an action on the rig for the end of the tick."""
        self._tick += journal.event_entry(now_ns, what)

    def punctual(self, lateness_ns: int, execution_ns: int) -> None:
        """Store delay and duration of the tick."""
        self._punctual[0] = lateness_ns * 1e-9
        self._punctual[1] = execution_ns * 1e-9


class PublishedTiming(Timing):
    """The timing of a run that is also published to the panel.

    Args:
        publisher: takes delay and duration of each tick.

    """

    def __init__(self, publisher: LoopPublisher) -> None:
        super().__init__()
        self._publisher = publisher

    def add(self, lateness_ns: int, execution_ns: int) -> None:
        """Count a tick."""
        super().add(lateness_ns, execution_ns)
        self._publisher.punctual(lateness_ns, execution_ns)
