"""Resampling of all channels to one uniform time grid."""

from collections.abc import Mapping

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.reading import Series

FEWEST_SAMPLES = 50
"""Smallest number of samples of an experiment (assumed)."""

FASTEST = 1e-3
"""Shortest period of a grid [s]; faster data are averaged."""

IRREGULAR = 0.02
"""Relative deviation of a step from the period from which data are resampled."""

GAP = 5.0
"""Number of periods without a sample that make a gap, where values are not interpolated."""

SLOWER = 1.5
"""Ratio of a slower channel's sample period and that of the grid."""

SPARSEST, MOST_PERIODS = 100.0, 1e6
"""Largest number of periods per sample, if a grid has more than `MOST_PERIODS` (assumed)."""

Columns = dict[str, Array]


def ordered(series: Mapping[str, Series], notes: list[str]) -> dict[str, Series]:
    """Return the samples of each clock in the order of time, without repeated times."""
    clocks: dict[int, tuple[Array, np.ndarray]] = {}
    sorted_series = {}
    for name, one in series.items():
        if id(one.time) not in clocks:
            clocks[id(one.time)] = _order(one.time, notes)
        time, rows = clocks[id(one.time)]
        values = np.where(np.isfinite(one.values), one.values, np.nan)[rows]
        missing = int(np.sum(~np.isfinite(values)))
        if missing and name != SET_POINT:  # a set point holds; `data` notes its gaps
            notes.append(f"{name}: {missing} values are missing")
        sorted_series[name] = Series(time, values)
    return sorted_series


def _order(time: Array, notes: list[str]) -> tuple[Array, np.ndarray]:
    """Return increasing times, and their rows."""
    good = np.flatnonzero(np.isfinite(time))
    if len(good) < len(time):
        notes.append(f"{len(time) - len(good)} rows without a time were left out")
    backwards = int(np.sum(np.diff(time[good]) < 0.0))
    if backwards:
        notes.append(f"time runs backwards {backwards} times; rows were put in order")
    rows = good[np.argsort(time[good], kind="stable")]
    new = np.concatenate([[True], np.diff(time[rows]) > 0.0]) if len(rows) else rows > 0
    if not new.all():
        notes.append(f"{int(np.sum(~new))} rows repeat a time; the first of each was kept")
    return time[rows[new]], rows[new]


def uniform(name: str, series: Mapping[str, Series], notes: list[str]) -> tuple[float, Columns]:
    """Return the period [s] and every channel on the grid of the fastest one, NaN inside gaps.

    Args:
        name: of the recording, for messages.
        series: as `ordered` returns them.
        notes: sentences on resampling are added.

    Raises:
        UserError: if there are too few samples, or channels have no time in common.

    """
    readings = [s.time for n, s in series.items() if n != SET_POINT] or [
        s.time for s in series.values()
    ]
    longest = max(readings, key=len)
    if len(longest) < FEWEST_SAMPLES:
        raise UserError(
            f"{name}: {len(longest)} usable samples; at least {FEWEST_SAMPLES} are needed"
        )
    usual = [t for t in readings if len(t) >= FEWEST_SAMPLES]
    base = min(usual, key=lambda t: float(np.median(np.diff(t))))
    period = _nice(float(np.median(np.diff(base))))
    _overlapping(name, series, base)
    _check_span(name, base, period)
    grid = _grid(base, period, notes)
    columns = {
        n: _held(s, grid) if n == SET_POINT else _placed(n, s, grid, period, notes)
        for n, s in series.items()
    }
    return period, columns


def _nice(typical: float) -> float:
    """Return the nominal period, at least `FASTEST` [s]."""
    whole = 1e-4 * max(1.0, round(typical / 1e-4))
    return max(whole if abs(whole / typical - 1.0) < IRREGULAR else typical, FASTEST)


def _overlapping(name: str, series: Mapping[str, Series], base: Array) -> None:
    for channel, one in series.items():
        if not len(one.time) or one.time[0] > base[-1] or one.time[-1] < base[0]:
            raise UserError(
                f"{name}: {channel} has no time in common with the other channels; they come "
                "from two clocks: put all channels on one"
            )


def _check_span(name: str, base: Array, period: float) -> None:
    """Refuse times with few samples in a long span: the grid would need too much memory."""
    periods = (base[-1] - base[0]) / period
    if not periods <= max(MOST_PERIODS, SPARSEST * len(base)):
        raise UserError(
            f"{name}: {len(base)} samples over {periods:.3g} periods of {period * 1e3:.3g} ms: its "
            "time is wrong, or it has to be cut into parts"
        )


def _grid(base: Array, period: float, notes: list[str]) -> Array:
    """Return regular times as they are, else a uniform grid over their span."""
    steps = np.diff(base)
    gaps = steps > GAP * period
    if gaps.any():
        count = int(np.sum(gaps))
        total = f"{float(np.sum(steps[gaps])):.3g} s"
        notes.append(f"1 gap of {total}" if count == 1 else f"{count} gaps, {total} in all")
    uneven = np.abs(steps - period) > IRREGULAR * period
    if not uneven.any():
        return base
    if np.median(steps) < 0.9 * FASTEST:
        rate = 1e-3 / float(np.median(steps))
        notes.append(f"{rate:.3g} kHz; averaged over {period * 1e3:.3g} ms")
    elif uneven[~gaps].any():
        least, most = float(steps[~gaps].min()), float(steps[~gaps].max())
        notes.append(
            f"irregular time, steps of {least * 1e3:.3g} to {most * 1e3:.3g} ms; resampled to "
            f"{period * 1e3:.3g} ms"
        )
    return np.asarray(base[0] + period * np.arange(int((base[-1] - base[0]) / period + 1e-6) + 1))


def _held(series: Series, grid: Array) -> Array:
    """Return a set point at each time; each value holds until the next."""
    good = np.isfinite(series.values)
    time, values = series.time[good], series.values[good]
    if not len(time):
        return np.full(len(grid), np.nan)
    if len(time) > 1 and np.median(np.diff(time)) < 0.9 * FASTEST:
        period = float(grid[1] - grid[0])
        return _averaged(
            time, values, grid + 0.5 * period, period
        )  # a value acts until the next one
    before = np.searchsorted(time, grid + 1e-9, side="right") - 1
    return np.asarray(np.where(before >= 0, values[np.maximum(before, 0)], np.nan))


def _placed(name: str, series: Series, grid: Array, period: float, notes: list[str]) -> Array:
    """Return readings on the grid: unchanged, averaged, interpolated, or at the nearest times."""
    if len(series.time) == len(grid) and np.array_equal(series.time, grid):
        return series.values
    good = np.isfinite(series.values)
    time, values = series.time[good], series.values[good]
    if not len(time):
        return np.full(len(grid), np.nan)
    typical = float(np.median(np.diff(series.time)))
    if typical < 0.9 * FASTEST:
        return _averaged(time, values, grid, period)
    if typical > SLOWER * period:
        notes.append(
            f"{name}: a sample every {typical * 1e3:.3g} ms; values between are not interpolated"
        )
        return _at_nearest_times(time, values, grid, period)
    return _between(time, values, grid, period)


def _averaged(time: Array, values: Array, grid: Array, period: float) -> Array:
    """Return the mean of the samples within half a period of each grid point."""
    place = np.round((time - grid[0]) / period).astype(np.int64)
    inside = (place >= 0) & (place < len(grid))
    count = np.bincount(place[inside], minlength=len(grid))
    total = np.bincount(place[inside], values[inside], minlength=len(grid))
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _at_nearest_times(time: Array, values: Array, grid: Array, period: float) -> Array:
    out = np.full(len(grid), np.nan)
    place = np.round((time - grid[0]) / period).astype(np.int64)
    inside = (place >= 0) & (place < len(grid))
    out[place[inside]] = values[inside]
    return out


def _between(time: Array, values: Array, grid: Array, period: float) -> Array:
    """Interpolate, except inside gaps."""
    if len(time) < 2:
        return np.full(len(grid), np.nan)
    before = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(time) - 2)
    hole = np.diff(time)[before] > GAP * period
    hole &= (grid - time[before] > 0.5 * period) & (time[before + 1] - grid > 0.5 * period)
    outside = (grid < time[0] - 0.5 * period) | (grid > time[-1] + 0.5 * period)
    line = np.interp(grid, time, values)
    return np.asarray(np.where(hole | outside, np.nan, line))
