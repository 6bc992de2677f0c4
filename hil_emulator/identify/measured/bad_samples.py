"""Bad samples, which no sensor measured: spikes, readings at a rail, repeated rows.

A sample is a candidate if it is far from the cubic through its four neighbours, and no other sample
near it deviates after it is put on that cubic. A step, an impact or a ringing deviates at several
samples. In a slow log an impact may be a single sample, so a candidate is bad only in three cases:

- a position changes faster than in any other motion of the log;
- a value recurs exactly;
- a value is far outside all others.

The check comes before resampling.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import UNITS, Array, Mask
from hil_emulator.identify.measured.grid import FEWEST_SAMPLES
from hil_emulator.identify.measured.reading import Series
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.units import read_as, show

DEVIATION_WINDOW = 101
"""Length of the window for the usual deviation [samples] (assumed)."""

OUTLIER_RATIO = 5.0
"""Ratio of a candidate's deviation from the cubic and the usual deviation (assumed)."""

REMAINING_DEVIATION = 0.25
"""Largest remaining deviation near a candidate, relative to that of the candidate (assumed)."""

EXCURSION_SHARE = 0.5
"""Smallest excursion beyond both neighbours, relative to the deviation (assumed)."""

IMPOSSIBLE_SPEED_RATIO = 5.0
"""Ratio of an impossible excursion and the largest usual change per sample (assumed)."""

USUAL_CHANGES = 0.98
"""Quantile of the usual changes: bad samples are 1 % at most (assumed)."""

FEWEST_AT_RAIL = 3
"""Number of candidates with the same value that make this value a rail."""

FAR_RANGES = 10.0
"""Distance of an impossible value from all others, relative to their range (assumed)."""

RAIL_RANGES = 0.5
"""`FAR_RANGES` of a value that recurs exactly, unless it is zero (assumed)."""

MOST_BAD_SAMPLES = 0.1
"""Share of candidates above which they are taken for the signal (assumed)."""

REPEATED_SHARE = 0.05
"""Largest share of samples that equal the previous one in a channel with noise (assumed)."""

AROUND = 7
"""Length of the running median, more than twice that of a run of bad samples (assumed)."""

RUN_LENGTHS = (1, 2)
"""Lengths of the runs of bad samples."""

_SHOWN = {c.name: (c.unit, c.shown) for c in CHANNELS} | {SET_POINT: ("A", "mA")}
_Run = tuple[np.ndarray[Any, np.dtype[np.int64]], float]  # samples, deviation from the cubic
_NEAR = 5  # samples on each side of a run that must not deviate
_Rows = np.ndarray[Any, np.dtype[np.int64]]


def without_bad_samples(series: Mapping[str, Series], notes: list[str]) -> dict[str, Series]:
    """Return channels in which bad samples are missing.

    Args:
        series: channels in order of time.
        notes: a sentence on the number and times of the bad samples is added.

    Returns:
        Channels with NaN at bad samples; a set point is interpolated there.

    """
    twice = _repeated_rows(series)
    cleaned = {}
    for name, one in series.items():
        rows = bad_samples(name, one)
        if len(rows):
            unit, shown = _SHOWN.get(name) or (UNITS[name], UNITS[name])
            shown = read_as(unit, shown)
            low, high = (show(v, unit, shown) for v in (one.values[rows].min(),
                                                        one.values[rows].max()))  # fmt: skip
            values = low if low == high else f"{low} ... {high}"
            done = "the line between the others" if name == SET_POINT else "left out"
            notes.append(f"{name}: {_counted(rows, one)} are impossible ({values}); {done}")
        gone = np.union1d(rows, twice if name != SET_POINT else rows).astype(np.int64)
        kept = _emptied(one.values, gone)
        cleaned[name] = Series(one.time, _bridged(kept, rows) if name == SET_POINT else kept)
    if len(twice):
        notes.append(f"{_counted(twice, one)} repeat the row before in every channel; left out")
    return cleaned


def bad_samples(name: str, series: Series) -> _Rows:
    """Return the indices of the bad samples of a channel."""
    good = np.flatnonzero(np.isfinite(series.values))
    if len(good) < FEWEST_SAMPLES:
        return np.zeros(0, np.int64)
    values = series.values[good]
    runs = candidates(values)
    odd = _joined([rows for rows, _ in runs])
    bad = [_far(values, odd), _at_rail(values, odd)]
    if name == "position":
        bad += [_too_fast(values, runs), _brief(values)]
    rows = _joined(bad)
    rows = np.union1d(rows, _same(values, rows))
    return np.asarray(good[rows] if len(rows) < MOST_BAD_SAMPLES * len(values) else good[:0])


def candidates(values: Array) -> list[_Run]:
    """Return isolated deviating runs of samples, and the deviation of each from the cubic."""
    runs, values = [], values.copy()
    for length in RUN_LENGTHS:
        runs += _runs(values, length)
    # a run that was put on the cubic may have hidden another one
    return runs + _runs(values, RUN_LENGTHS[0]) if runs else runs


def _runs(values: Array, length: int) -> list[_Run]:
    """Return the runs of a length, and put them on the cubic."""
    runs: list[_Run] = []
    predicted = _between(values, length)
    deviation = np.max(np.abs(_windows(values, length) - predicted), axis=1)
    out = np.flatnonzero(deviation > OUTLIER_RATIO * _usual(values))
    if not _alone_odd(values, out, predicted[out], deviation[out]).any():
        return runs
    # the largest deviation first: it makes its neighbours deviate
    for first in out[np.argsort(-deviation[out], kind="stable")]:
        here = slice(first, first + 1)
        if _alone_odd(values, np.array([first]), predicted[here], deviation[here])[0]:
            run = np.arange(first, first + length)
            values[run] = predicted[first]
            runs.append((run, float(deviation[first])))
    return runs


def _windows(values: Array, length: int) -> Array:
    """Return the run of a length that begins at each sample, padded beyond the last one."""
    padded = np.pad(values, (0, length - 1), mode="edge")
    return np.column_stack([padded[i : i + len(values)] for i in range(length)])


def _between(values: Array, length: int) -> Array:
    """Return the cubic through two samples on each side of the run at each sample."""
    return _cubic(np.pad(values, (2, length + 1), mode="edge"), length)


def _cubic(values: Array, length: int) -> Array:
    """Return the cubic for each run with two samples on both sides, along the last axis."""
    nodes = np.array([-2, -1, length, length + 1])
    count = values.shape[-1] - length - 3
    neighbours = [values[..., 2 + n : 2 + n + count] for n in nodes]
    inside = np.arange(length)[:, None]
    weights = np.array([
        np.prod([(inside[:, 0] - m) / (n - m) for m in nodes if m != n], axis=0) for n in nodes
    ])  # fmt: skip
    return np.asarray(np.stack(neighbours, axis=-1) @ weights)


def _usual(values: Array) -> Array:
    """Return the usual deviation from the cubic near each sample."""
    size = np.abs(values - _between(values, 1)[:, 0])
    count = -(-len(size) // DEVIATION_WINDOW)
    blocks = np.pad(size, (0, count * DEVIATION_WINDOW - len(size)), mode="reflect")
    levels = np.pad(
        np.median(blocks.reshape(count, DEVIATION_WINDOW), axis=1) / 0.6745, 1, mode="edge"
    )
    around = np.max([levels[:-2], levels[1:-1], levels[2:]], axis=0)  # a motion may begin here
    steps = np.abs(np.diff(values))
    moved = steps[steps > 0.0]
    floor = float(np.median(moved)) if len(moved) else np.inf
    return np.asarray(np.maximum(np.repeat(around, DEVIATION_WINDOW)[: len(size)], floor))


def _alone_odd(values: Array, firsts: _Rows, predicted: Array, deviation: Array) -> Mask:
    """Return whether no sample near a run deviates after the run is put on the cubic.

    Args:
        values: of the channel.
        firsts: first samples of the runs.
        predicted: the cubic at each run, shape (runs, samples of a run).
        deviation: of each run from the cubic.

    """
    length = predicted.shape[1]
    inside = (firsts >= _NEAR) & (firsts + length + _NEAR <= len(values))
    around = np.clip(firsts, _NEAR, max(_NEAR, len(values) - length - _NEAR))[:, None]
    near = values[around + np.arange(-_NEAR, length + _NEAR)]
    run, neighbours = near[:, _NEAR:-_NEAR].copy(), near[:, [_NEAR - 1, _NEAR + length]]
    low, high = neighbours.min(axis=1)[:, None], neighbours.max(axis=1)[:, None]
    # a sample of a step from one level to another lies between its neighbours
    returns = np.maximum(low - run, run - high).min(axis=1) >= EXCURSION_SHARE * deviation
    near[:, _NEAR:-_NEAR] = predicted
    rest = np.abs(near[:, 2:-2] - _cubic(near, 1)[:, :, 0]).max(axis=1)
    return np.asarray(inside & returns & (rest < REMAINING_DEVIATION * deviation))


def _joined(runs: Sequence[_Rows]) -> _Rows:
    return np.unique(np.concatenate([np.zeros(0, np.int64), *runs]))


def _far(values: Array, odd: _Rows) -> _Rows:
    """Return the candidates that are far from every value that is not a candidate."""
    rest = np.delete(values, np.union1d(odd, _same(values, odd)))
    return np.asarray(odd[_outside(values[odd], rest) > FAR_RANGES])


def _at_rail(values: Array, odd: _Rows) -> _Rows:
    """Return the candidates of a value that recurs exactly, and is outside all others or zero."""
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
    """Return the distance of values from others, relative to the range of the others."""
    if not len(others):
        return np.zeros(np.shape(level))
    away = np.maximum(others.min() - level, level - others.max())
    return away / max(float(np.ptp(others)), 1e-30)


def _too_fast(values: Array, runs: Sequence[_Run]) -> _Rows:
    """Return the candidates that change faster than the rod usually moves."""
    fastest = IMPOSSIBLE_SPEED_RATIO * _fastest(values)
    return _joined([rows for rows, deviation in runs if deviation > fastest])


def _brief(values: Array) -> _Rows:
    """Return samples farther from the running median than the rod moves in its window.

    Two bad samples next to each other are not isolated, and are found here only.
    """
    reach = IMPOSSIBLE_SPEED_RATIO * (AROUND // 2) * _fastest(values)
    return np.flatnonzero(_from_median(values) > reach) if reach > 0.0 else np.zeros(0, np.int64)


def _fastest(values: Array) -> float:
    return float(np.quantile(np.abs(np.diff(values)), USUAL_CHANGES))


def _same(values: Array, rows: _Rows) -> _Rows:
    """Return every sample with the value of a bad one that deviates from its neighbours.

    These neighbours may be bad samples, too.
    """
    if not len(rows):
        return rows
    off = _from_median(values) > OUTLIER_RATIO * _usual(values)
    return np.flatnonzero(np.isin(values, values[rows]) & off)


def _from_median(values: Array) -> Array:
    """Return the distance of each sample from the running median, which preserves steps."""
    around = _windows(np.pad(values, AROUND // 2, mode="edge"), AROUND)[: len(values)]
    return np.asarray(np.abs(values - np.median(around, axis=1)))


def _repeated_rows(series: Mapping[str, Series]) -> _Rows:
    """Return rows that equal the row before in every channel, if noise makes that unlikely."""
    readings = [s for n, s in series.items() if n != SET_POINT]
    same = [np.diff(s.values, prepend=np.nan) == 0.0 for s in readings]
    if len({id(s.time) for s in readings}) != 1 or len(same) < 3 or not len(same[0]):
        return np.zeros(0, np.int64)
    if max(float(np.mean(s)) for s in same) > REPEATED_SHARE:
        return np.zeros(0, np.int64)
    return np.flatnonzero(np.all(same, axis=0))


def _counted(rows: _Rows, series: Series) -> str:
    """Return the number of samples, their share, and the times of the first ones."""
    begun = series.time[rows[:4]] - series.time[0]
    times = ", ".join(f"{t:.4g}" for t in begun)
    more = ", ..." if len(rows) > 4 else ""
    return f"{len(rows)} of {len(series.values)} samples ({times}{more} s after the first)"


def _bridged(values: Array, rows: _Rows) -> Array:
    """Return a set point, interpolated in some rows: it went on while its record was bad."""
    good = np.flatnonzero(np.isfinite(values))
    if len(good):
        values[rows] = np.interp(rows, good, values[good])
    return values


def _emptied(values: Array, rows: _Rows) -> Array:
    out = values.copy()
    out[rows] = np.nan
    return out
