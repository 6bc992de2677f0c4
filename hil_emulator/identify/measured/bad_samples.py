"""Samples that the sensor never saw: spikes, readings at a rail, rows written twice.

A sample is a candidate if the cubic through its four neighbours misses it by far, and nothing else
around it is odd once it lies on that cubic: a step, an impact or a ring is odd in more than one
place. In a slow log an impact may be one sample long, too, so a candidate is bad only where no
machine can have made it: a position faster than any other motion of the log, a value that returns
again and again, a value far outside all others. It is looked for before anything is resampled.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import UNITS, Array, Mask
from hil_emulator.identify.measured.grid import FEWEST_SAMPLES
from hil_emulator.identify.measured.reading import Series
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.units import show

DEVIATION_WINDOW = 101
"""Samples around each one from which the usual deviation is taken (assumed)."""

OUTLIER_RATIO = 5.0
"""Usual deviations from the cubic at which a sample becomes a candidate (assumed)."""

REMAINING_DEVIATION = 0.25
"""Largest deviation that may remain around a candidate, over its own (assumed)."""

EXCURSION_SHARE = 0.5
"""Distance from between its neighbours over the deviation: it leaves and returns (assumed)."""

IMPOSSIBLE_SPEED_RATIO = 5.0
"""Excursion within a sample over the largest usual change that no motion makes (assumed)."""

USUAL_CHANGES = 0.98
"""Part of the changes that are usual: bad samples are a percent at most (assumed)."""

FEWEST_AT_RAIL = 3
"""Candidates of exactly one value that make it a rail."""

FAR_RANGES = 10.0
"""Distance from all other values, over their range, that makes a value impossible (assumed)."""

RAIL_RANGES = 0.5
"""The same for a value that returns exactly, unless it is zero (assumed)."""

MOST_BAD_SAMPLES = 0.1
"""Part of the samples above which these are no bad samples but the signal (assumed)."""

REPEATED_SHARE = 0.05
"""Part of the samples that may repeat the one before in a channel with noise (assumed)."""

AROUND = 7
"""Samples of which the median is taken: bad ones are the fewer of them (assumed)."""

RUN_LENGTHS = (1, 2)
"""Numbers of bad samples in a row that are looked for, in turn."""

_SHOWN = {c.name: (c.unit, c.shown) for c in CHANNELS} | {SET_POINT: ("A", "mA")}
_Run = tuple[np.ndarray[Any, np.dtype[np.int64]], float]  # samples, deviation from the cubic
_NEAR = 5  # samples on each side of a run in which nothing else may be odd
_Rows = np.ndarray[Any, np.dtype[np.int64]]


def without_bad_samples(series: Mapping[str, Series], notes: list[str]) -> dict[str, Series]:
    """Return channels in which bad samples are missing.

    Args:
        series: channels in order of time.
        notes: takes how many were left out, and where.

    Returns:
        Channels that are missing there; a set point goes on from one neighbour to the other.

    """
    twice = _repeated_rows(series)
    found = {}
    for name, one in series.items():
        rows = bad_samples(name, one)
        if len(rows):
            unit, shown = _SHOWN.get(name) or (UNITS[name], UNITS[name])
            low, high = (show(v, unit, shown) for v in (one.values[rows].min(),
                                                        one.values[rows].max()))  # fmt: skip
            values = low if low == high else f"{low} ... {high}"
            done = "the line between the others" if name == SET_POINT else "left out"
            notes.append(f"{name}: {_counted(rows, one)} are impossible ({values}); {done}")
        gone = np.union1d(rows, twice if name != SET_POINT else rows).astype(np.int64)
        kept = _emptied(one.values, gone)
        found[name] = Series(one.time, _bridged(kept, rows) if name == SET_POINT else kept)
    if len(twice):
        notes.append(f"{_counted(twice, one)} repeat the row before in every channel; left out")
    return found


def bad_samples(name: str, series: Series) -> _Rows:
    """Return the places of the bad samples of a channel."""
    good = np.flatnonzero(np.isfinite(series.values))
    if len(good) < FEWEST_SAMPLES:
        return np.zeros(0, np.int64)
    values = series.values[good]
    runs = candidates(values)
    odd = _joined([rows for rows, _ in runs])
    found = [_far(values, odd), _at_rail(values, odd)]
    if name == "position":
        found += [_too_fast(values, runs), _brief(values)]
    rows = _joined(found)
    rows = np.union1d(rows, _same(values, rows))
    return np.asarray(good[rows] if len(rows) < MOST_BAD_SAMPLES * len(values) else good[:0])


def candidates(values: Array) -> list[_Run]:
    """Return the runs of samples that alone are odd, and how far each is from the cubic."""
    found, values = [], values.copy()
    for length in RUN_LENGTHS:
        found += _runs(values, length)
    # one may have hidden another
    return found + _runs(values, RUN_LENGTHS[0]) if found else found


def _runs(values: Array, length: int) -> list[_Run]:
    """Return the runs of a length, and put them on the cubic."""
    found: list[_Run] = []
    predicted = _between(values, length)
    deviation = np.max(np.abs(_windows(values, length) - predicted), axis=1)
    out = np.flatnonzero(deviation > OUTLIER_RATIO * _usual(values))
    if not _alone_odd(values, out, predicted[out], deviation[out]).any():
        return found
    # the largest deviation first: it makes its neighbours deviate
    for first in out[np.argsort(-deviation[out], kind="stable")]:
        here = slice(first, first + 1)
        if _alone_odd(values, np.array([first]), predicted[here], deviation[here])[0]:
            run = np.arange(first, first + length)
            values[run] = predicted[first]
            found.append((run, float(deviation[first])))
    return found


def _windows(values: Array, length: int) -> Array:
    """Return the runs of some length that begin at each sample; the last ones are cut short."""
    padded = np.pad(values, (0, length - 1), mode="edge")
    return np.column_stack([padded[i : i + len(values)] for i in range(length)])


def _between(values: Array, length: int) -> Array:
    """Return what the cubic through two samples on each side gives for a run at each sample."""
    return _cubic(np.pad(values, (2, length + 1), mode="edge"), length)


def _cubic(values: Array, length: int) -> Array:
    """Return the same for each run that has two samples on either side, along the last axis."""
    nodes = np.array([-2, -1, length, length + 1])
    count = values.shape[-1] - length - 3
    beside = [values[..., 2 + n : 2 + n + count] for n in nodes]
    inside = np.arange(length)[:, None]
    weights = np.array([
        np.prod([(inside[:, 0] - m) / (n - m) for m in nodes if m != n], axis=0) for n in nodes
    ])  # fmt: skip
    return np.asarray(np.stack(beside, axis=-1) @ weights)


def _usual(values: Array) -> Array:
    """Return how large the deviation from the cubic usually is around each sample."""
    size = np.abs(values - _between(values, 1)[:, 0])
    count = -(-len(size) // DEVIATION_WINDOW)
    blocks = np.pad(size, (0, count * DEVIATION_WINDOW - len(size)), mode="reflect")
    levels = np.pad(
        np.median(blocks.reshape(count, DEVIATION_WINDOW), axis=1) / 0.6745, 1, mode="edge"
    )
    around = np.max([levels[:-2], levels[1:-1], levels[2:]], axis=0)  # motion may just begin
    steps = np.abs(np.diff(values))
    moved = steps[steps > 0.0]
    floor = float(np.median(moved)) if len(moved) else np.inf
    return np.asarray(np.maximum(np.repeat(around, DEVIATION_WINDOW)[: len(size)], floor))


def _alone_odd(values: Array, firsts: _Rows, predicted: Array, deviation: Array) -> Mask:
    """Tell of runs whether nothing near each is odd once it lies on the cubic.

    Args:
        values: of the channel.
        firsts: first samples of the runs.
        predicted: what the cubic gives for each, shape (runs, samples of a run).
        deviation: how far each is from that.

    """
    length = predicted.shape[1]
    inside = (firsts >= _NEAR) & (firsts + length + _NEAR <= len(values))
    around = np.clip(firsts, _NEAR, max(_NEAR, len(values) - length - _NEAR))[:, None]
    near = values[around + np.arange(-_NEAR, length + _NEAR)]
    own, beside = near[:, _NEAR:-_NEAR].copy(), near[:, [_NEAR - 1, _NEAR + length]]
    low, high = beside.min(axis=1)[:, None], beside.max(axis=1)[:, None]
    # one on the way from one level to another does not leave and return
    returns = np.maximum(low - own, own - high).min(axis=1) >= EXCURSION_SHARE * deviation
    near[:, _NEAR:-_NEAR] = predicted
    rest = np.abs(near[:, 2:-2] - _cubic(near, 1)[:, :, 0]).max(axis=1)
    return np.asarray(inside & returns & (rest < REMAINING_DEVIATION * deviation))


def _joined(runs: Sequence[_Rows]) -> _Rows:
    return np.unique(np.concatenate([np.zeros(0, np.int64), *runs]))


def _far(values: Array, odd: _Rows) -> _Rows:
    """Return the candidates to which no value comes near that is not one."""
    rest = np.delete(values, np.union1d(odd, _same(values, odd)))
    return np.asarray(odd[_outside(values[odd], rest) > FAR_RANGES])


def _at_rail(values: Array, odd: _Rows) -> _Rows:
    """Return the candidates of a value that returns exactly, and lies apart or is zero."""
    levels, counts = np.unique(values[odd], return_counts=True)
    rails = [
        level for level, count in zip(levels, counts, strict=True)
        if count >= FEWEST_AT_RAIL and (
            _outside(level, values[values != level]) > RAIL_RANGES
            or (level == 0.0 and count > 0.5 * np.sum(values == 0.0))
        )
    ]  # fmt: skip
    return np.asarray(odd[np.isin(values[odd], rails)])


def _outside(level: Any, others: Array) -> Any:
    """Return how far values are outside others, over the range of those."""
    if not len(others):
        return np.zeros(np.shape(level))
    away = np.maximum(others.min() - level, level - others.max())
    return away / max(float(np.ptp(others)), 1e-30)


def _too_fast(values: Array, runs: Sequence[_Run]) -> _Rows:
    """Return the candidates that change faster than the rod usually moves."""
    fastest = IMPOSSIBLE_SPEED_RATIO * _fastest(values)
    return _joined([rows for rows, deviation in runs if deviation > fastest])


def _brief(values: Array) -> _Rows:
    """Return samples that are farther off than the rod moves: bad ones that hide each other."""
    reach = IMPOSSIBLE_SPEED_RATIO * (AROUND // 2) * _fastest(values)
    return np.flatnonzero(_from_median(values) > reach) if reach > 0.0 else np.zeros(0, np.int64)


def _fastest(values: Array) -> float:
    return float(np.quantile(np.abs(np.diff(values)), USUAL_CHANGES))


def _same(values: Array, rows: _Rows) -> _Rows:
    """Return every sample at exactly the value of a bad one, and off its neighbours.

    Whatever these are: two bad samples may stand side by side.
    """
    if not len(rows):
        return rows
    off = _from_median(values) > OUTLIER_RATIO * _usual(values)
    return np.flatnonzero(np.isin(values, values[rows]) & off)


def _from_median(values: Array) -> Array:
    """Return how far each sample is from the median of those around it, which no step moves."""
    around = _windows(np.pad(values, AROUND // 2, mode="edge"), AROUND)[: len(values)]
    return np.asarray(np.abs(values - np.median(around, axis=1)))


def _repeated_rows(series: Mapping[str, Series]) -> _Rows:
    """Return rows in which every channel repeats a value that its noise hardly ever repeats."""
    readings = [s for n, s in series.items() if n != SET_POINT]
    same = [np.diff(s.values, prepend=np.nan) == 0.0 for s in readings]
    if len({id(s.time) for s in readings}) != 1 or len(same) < 3 or not len(same[0]):
        return np.zeros(0, np.int64)
    if max(float(np.mean(s)) for s in same) > REPEATED_SHARE:
        return np.zeros(0, np.int64)
    return np.flatnonzero(np.all(same, axis=0))


def _counted(rows: _Rows, series: Series) -> str:
    """Return how many samples of how many, and when the first ones were taken."""
    begun = series.time[rows[:4]] - series.time[0]
    times = ", ".join(f"{t:.4g}" for t in begun)
    more = ", ..." if len(rows) > 4 else ""
    return f"{len(rows)} of {len(series.values)} samples ({times}{more} s after the first)"


def _bridged(values: Array, rows: _Rows) -> Array:
    """Return a set point that goes straight where it is unknown: it went on, whatever was read."""
    good = np.flatnonzero(np.isfinite(values))
    if len(good):
        values[rows] = np.interp(rows, good, values[good])
    return values


def _emptied(values: Array, rows: _Rows) -> Array:
    out = values.copy()
    out[rows] = np.nan
    return out
