"""State of a bench from the loop's entries or a recording: rows, frames, events."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hil_emulator.panel.history import History
from hil_emulator.panel.traffic import Frames
from hil_emulator.recording.journal import EntryKind, Recording, event_of, frames_of, split
from hil_emulator.signals.inputs import SETTINGS, shown
from hil_emulator.units import to_si

LATENESS, EXECUTION = "loop.lateness", "loop.execution"
"""Names of the loop's delay and duration per tick [s], beyond a recording's columns."""
_EVENTS = 500
"""Number of marks on the strips (assumed)."""
_SPREAD_S = 10.0
_QUIET = {"serve", "slipped", "bus_load"}
"""Events without a mark, because they do not act on the rig."""


class LiveState:
    """Collects the entries of a journal.

    Args:
        header: of a recording.
        columns: of a row, name to unit.
        bit_rate: of the bus [bit/s].
        ticks: rows to keep; None for those of a live bench.

    Attributes:
        history: the rows.
        traffic: the frames.
        events: number, time [s] and words of actions on the rig.
        listeners: called with each entry: kind and payload.

    """

    def __init__(
        self, header: Mapping[str, Any], columns: Mapping[str, str], bit_rate: float,
        ticks: int | None = None,
    ) -> None:  # fmt: skip
        tick = header["tick_ns"] * 1e-9
        self.columns = dict(columns)
        self.history = History(len(columns), tick, ticks)
        self.traffic = Frames(header, bit_rate)
        self.events: deque[tuple[int, float, str]] = deque(maxlen=_EVENTS)
        self.listeners: list[Callable[[int, bytes], None]] = []
        self._marks = 0

    @property
    def now(self) -> float:
        """Emulator time of the last row [s]."""
        return (self.history.end - 1) * self.history.tick

    def row(self, time: float) -> list[float | None]:
        """Return the row of a time [s]; None if unknown."""
        tick = min(max(round(time / self.history.tick), self.history.begin), self.history.end - 1)
        values, _ = self.history.buckets(list(range(len(self.columns))), tick, 1, 1)
        return [float(v) if np.isfinite(v) else None for v in values[:, 0]]

    def spread(self, name: str) -> list[float]:
        """Return p50, p99 and maximum of a signal in the last 10 s."""
        column = list(self.columns).index(name)
        ticks = round(_SPREAD_S / self.history.tick)
        first = max(self.history.begin, self.history.end - ticks)
        values = self.history.buckets([column], first, self.history.end - first, 1)[0][0]
        values = values[np.isfinite(values)]
        if not len(values):
            return [0.0, 0.0, 0.0]
        p50, p99 = np.percentile(values, (50, 99))
        return [float(p50), float(p99), float(values.max())]

    def take(self, data: bytes) -> None:
        """Add complete entries."""
        rows = []
        for kind, payload in split(data):
            if kind == EntryKind.ROW:
                rows.append(payload)
            elif kind == EntryKind.BUS:
                self.traffic.take(frames_of(payload))
            elif kind == EntryKind.EVENT:
                self.mark(*event_of(payload))
            for listener in self.listeners:
                listener(kind, payload)
        if rows:
            width = len(self.columns)
            self.history.append(np.frombuffer(b"".join(rows)).reshape(-1, width))

    def mark(self, now_ns: int, what: Mapping[str, Any]) -> None:
        """Add a mark for an action on the rig."""
        if not what.keys() & _QUIET:
            self._marks += 1
            self.events.append((self._marks, now_ns * 1e-9 + _delay(what), in_words(what)))


def _delay(what: Mapping[str, Any]) -> float:
    """Return how long [s] after its injection a fault begins."""
    match what:
        case {"fault": {"start": start}}:
            return to_si(start, "s")
    return 0.0


def in_words(what: Mapping[str, Any]) -> str:
    """Return an event of a recording in words."""
    match what:
        case {"fault": {"target": target, "kind": kind, "condition": condition}}:
            return f"{target} {kind}, when {condition}"
        case {"fault": {"target": target, "kind": kind}}:
            return f"{target} {kind}"
        case {"end": number}:
            return f"end of fault {number}"
        case {"set": dict(values)}:
            return ", ".join(f"{name} {_amount(name, value)}" for name, value in values.items())
        case {"marker": text}:
            return str(text)
    return ", ".join(what)


def _amount(name: str, value: float) -> str:
    param = SETTINGS.get(name)
    return f"{value:g}" if param is None else shown(param, value)


def of_recording(recording: Recording, bit_rate: float) -> LiveState:
    """Return a whole recording."""
    ticks = max(1, len(recording.rows))
    state = LiveState(recording.header, recording.units, bit_rate, ticks)
    state.history.append(recording.rows)
    state.traffic.take(recording.frames)
    for now_ns, what in recording.events:
        state.mark(now_ns, what)
    return state
