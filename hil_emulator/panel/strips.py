"""Messages for a page's strips: buckets of signals, see `protocol.stream`.

A live message repeats the last bucket of the one before, which was incomplete.
"""

from collections.abc import Sequence

import numpy as np

from hil_emulator.panel.history import History
from hil_emulator.protocol.stream import HEAD, LIVE, PAST


class Strips:
    """The strips of one browser.

    Args:
        history: of the bench.

    """

    def __init__(self, history: History) -> None:
        self._history = history
        self._columns: list[int] = []
        self._width, self._count, self._next = 1, 0, 0
        self._generation = 0
        self.number = 0

    def follow(self, columns: Sequence[int], span: float, pixels: int, generation: int) -> None:
        """Show signals live from now on.

        Args:
            columns: indices of the signals; empty to pause.
            span: displayed time [s].
            pixels: width of the strips.
            generation: number of the request, repeated in every message.

        """
        history = self._history
        ticks = span / history.tick
        self._columns, self._generation = list(columns), generation
        begin = max(history.oldest, history.end - round(ticks))
        self._width = history.width_for(ticks, pixels, begin)
        self._count = round(ticks / self._width) + 1
        self._next = begin // self._width

    def news(self, stamp_ns: int) -> bytes:
        """Return the message of new data since the last one."""
        history, width = self._history, self._width
        last = max(0, history.end - 1) // width
        first = min(last, max(self._next, last - self._count + 1))
        self._next = last
        return self._message(LIVE, self._columns, (first, last - first + 1, width), stamp_ns)

    def window(
        self, columns: Sequence[int], span: tuple[float, float], pixels: int, generation: int
    ) -> bytes:
        """Return the message of a time window [s]."""
        history = self._history
        low, high = (round(t / history.tick) for t in span)
        low, high = max(low, history.oldest), min(high, history.end)
        high = max(low + 1, high)
        width = history.width_for(high - low, pixels, low)
        self._generation = generation
        place = (low // width, -(-high // width) - low // width, width)
        return self._message(PAST, list(columns), place, 0)

    def _message(
        self, kind: int, columns: list[int], place: tuple[int, int, int], stamp_ns: int
    ) -> bytes:
        history = self._history
        first, count, width = place
        low, high = history.buckets(columns, first, count, width)
        self.number += 1
        head = HEAD.pack(
            kind, len(columns), count, self._generation, self.number, first * width * history.tick,
            width * history.tick, (history.end - 1) * history.tick, stamp_ns * 1e-9,
        )  # fmt: skip
        parts = [history.latest()] if kind == LIVE else []
        return head + b"".join(np.ascontiguousarray(p).tobytes() for p in (*parts, low, high))
