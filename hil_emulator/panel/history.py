"""History of the signals for the strips: rows of the last minute, and extremes for ten minutes.

A strip requests as many buckets as it has pixels and gets the minimum and maximum of each, so that
every spike stays visible at any time scale. Memory is constant.
"""

from typing import Any

import numpy as np

from hil_emulator.protocol.page import LONGEST_S

Values = np.ndarray[Any, np.dtype[np.float32]]

COARSE = 16
"""Ticks of a bucket of stored extremes (assumed)."""
_MOST_VALUES = 1 << 20
"""Values per block when extremes are computed (assumed)."""
_FINE_TICKS = 1 << 16  # rows kept as they are: a minute at 1 kHz (assumed)


class History:
    """Rows by the number of their tick.

    Args:
        width: columns of a row.
        tick: period of the ticks [s].
        ticks: number to keep, of a recording; None for a live bench: `LONGEST_S` in all.

    Attributes:
        begin: number of the first known tick.
        end: number of the next tick.

    """

    def __init__(self, width: int, tick: float, ticks: int | None = None) -> None:
        self.tick = tick
        self.begin = self.end = 0
        fine = ticks or _FINE_TICKS
        self._fine = np.full((fine, width), np.nan, np.float32)
        buckets = (ticks or max(fine, round(LONGEST_S / tick))) // COARSE + 2
        self._low = np.full((buckets, width), np.nan, np.float32)
        self._high = self._low.copy()
        self._empty = True

    @property
    def oldest(self) -> int:
        """Number of the oldest stored tick."""
        return max(self.begin, self.end - (len(self._low) - 1) * COARSE)

    def append(self, rows: np.ndarray[Any, np.dtype[np.float64]]) -> None:
        """Append rows of consecutive ticks, time [s] first; missed ticks stay empty."""
        for chunk in np.split(rows, range(len(self._fine), len(rows), len(self._fine))):
            if len(chunk):
                self._take(chunk)

    def buckets(
        self, columns: list[int], first: int, count: int, width: int
    ) -> tuple[Values, Values]:
        """Return minima and maxima, each of shape (columns, buckets); NaN without a value.

        Args:
            columns: indices of the columns.
            first: number of the first bucket: tick over `width`.
            count: number of buckets.
            width: ticks of a bucket; a multiple of `COARSE` from there on.

        """
        block = max(1, _MOST_VALUES // (count * width))
        parts = [
            self._extremes(columns[at : at + block], first, count, width)
            for at in range(0, max(1, len(columns)), block)
        ]
        if len(parts) == 1:
            return parts[0]
        low, high = zip(*parts, strict=True)
        return np.concatenate(low), np.concatenate(high)

    def _extremes(
        self, columns: list[int], first: int, count: int, width: int
    ) -> tuple[Values, Values]:
        if width < COARSE:
            fine = self._ticks(columns, first * width, count * width).reshape(
                count, width, len(columns)
            )
            return np.fmin.reduce(fine, axis=1).T, np.fmax.reduce(fine, axis=1).T
        part = width // COARSE
        numbers = np.arange(first * part, (first + count) * part)
        stored = (numbers >= self.oldest // COARSE) & (numbers * COARSE < self.end)
        places = np.ix_(numbers % len(self._low), np.array(columns, int))
        low, high = self._low[places], self._high[places]
        low[~stored] = high[~stored] = np.nan
        shape = (count, part, len(columns))
        low, high = low.reshape(shape), high.reshape(shape)
        return np.fmin.reduce(low, axis=1).T, np.fmax.reduce(high, axis=1).T

    def width_for(self, ticks: float, pixels: int, first: int) -> int:
        """Return a width so that at most `pixels` buckets cover the ticks from `first`."""
        width = max(1, int(np.ceil(ticks / max(1, pixels))))
        if width >= COARSE or first < self.end - len(self._fine):
            return -(-width // COARSE) * COARSE
        return width

    def latest(self) -> Values:
        """Return the last row; NaN before there is any."""
        row: Values = self._fine[(self.end - 1) % len(self._fine)]
        return row

    def _ticks(self, columns: list[int], first: int, count: int) -> Values:
        numbers = np.arange(first, first + count)
        stored = (numbers >= max(self.begin, self.end - len(self._fine))) & (numbers < self.end)
        values: Values = self._fine[np.ix_(numbers % len(self._fine), np.array(columns, int))]
        values[~stored] = np.nan
        return values

    def _take(self, rows: np.ndarray[Any, np.dtype[np.float64]]) -> None:
        number = round(float(rows[0, 0]) / self.tick)
        if self._empty:
            self.begin = self.end = number
            self._empty = False
        if number > self.end:  # missed ticks within the stored range
            gap = np.arange(max(self.end, number - len(self._fine)), number)
            self._fine[gap % len(self._fine)] = np.nan
        changed = self.end
        self.end = number + len(rows)
        self._fine[np.arange(number, self.end) % len(self._fine)] = rows
        self._coarsen(max(changed, self.end - len(self._fine), self.begin))

    def _coarsen(self, changed: int) -> None:
        """Compute the extremes of the buckets from that of a tick on."""
        first, last = changed // COARSE, -(-self.end // COARSE)
        every = list(range(self._fine.shape[1]))
        fine = self._ticks(every, first * COARSE, (last - first) * COARSE)
        fine = fine.reshape(last - first, COARSE, -1)
        places = np.arange(first, last) % len(self._low)
        self._low[places] = np.fmin.reduce(fine, axis=1)
        self._high[places] = np.fmax.reduce(fine, axis=1)
