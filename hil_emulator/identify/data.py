"""From recordings to experiments: one time grid, and an account of what was wrong with it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.experiment import SPANS, Array, Experiment
from hil_emulator.identify.reading import SET_POINT, Recording, read

FEWEST = 50
"""Samples below which nothing can be said (assumed)."""

FASTEST = 1e-3
"""Sample period that no grid goes below [s]: faster data are averaged."""

IRREGULAR = 0.02
"""Relative deviation of a step from the period that calls for resampling."""

GAP = 5.0
"""Periods without a sample that make a gap: nothing is interpolated there."""

DEAD = 1e-9
"""Change of a channel over its span below which it shows nothing."""

STUCK = 0.05
"""Part of the samples at one extreme value that looks like a saturated channel."""

BEYOND = 3.0
"""Spans beyond which a reading has hardly the unit that its column states (assumed)."""


def load_experiments(files: Sequence[Path]) -> list[Experiment]:
    """Read experiments.

    Raises:
        UserError: if a file cannot be used.

    """
    return [experiment(read(file)) for file in files]


def experiment(recording: Recording) -> Experiment:
    """Bring a recording to a uniform grid and report what was found."""
    notes: list[str] = []
    if recording.ignored:
        notes.append(f"ignored columns: {', '.join(recording.ignored)}")
    time, columns = _ordered(recording, notes)
    period = _period(recording, time)
    time, columns = _uniform(time, columns, period, notes)
    current = columns.pop(SET_POINT, np.zeros(0))
    if len(current) and recording.emulated:
        # the emulator's row holds what acted before its readings were taken
        current = np.append(current[1:], current[-1])
    if len(current):
        current = _held(current, notes)
    _inspect(columns, notes)
    readings = {n: v for n, v in columns.items() if np.isfinite(v).any()}
    return Experiment(
        recording.file.name, period, current, readings, tuple(notes), recording.digest
    )


def _ordered(recording: Recording, notes: list[str]) -> tuple[Array, dict[str, Array]]:
    """Return the rows in order of time, each time once."""
    time = recording.columns["time"]
    rest = {n: v for n, v in recording.columns.items() if n != "time"}
    good = np.isfinite(time)
    if not good.all():
        notes.append(f"{int(np.sum(~good))} rows without a time were left out")
    time, rest = time[good], {n: v[good] for n, v in rest.items()}
    if np.any(np.diff(time) < 0.0):
        backwards = int(np.sum(np.diff(time) < 0.0))
        notes.append(f"time runs backwards {backwards} times; rows were put in order")
    order = np.argsort(time, kind="stable")
    time, rest = time[order], {n: v[order] for n, v in rest.items()}
    new = np.concatenate([[True], np.diff(time) > 0.0]) if len(time) else np.zeros(0, bool)
    if not new.all():
        notes.append(f"{int(np.sum(~new))} rows repeat a time; the first of each was kept")
    for name, values in rest.items():
        missing = int(np.sum(~np.isfinite(values)))
        if missing:
            notes.append(f"{name}: {missing} values are missing")
    return time[new], {n: v[new] for n, v in rest.items()}


def _period(recording: Recording, time: Array) -> float:
    if len(time) < FEWEST:
        raise UserError(
            f"{recording.file}: {len(time)} usable samples; at least {FEWEST} are needed"
        )
    typical = float(np.median(np.diff(time)))
    nice = 1e-4 * max(1.0, round(typical / 1e-4))
    return max(nice if abs(nice / typical - 1.0) < IRREGULAR else typical, FASTEST)


def _uniform(
    time: Array, columns: dict[str, Array], period: float, notes: list[str]
) -> tuple[Array, dict[str, Array]]:
    """Return everything on a uniform grid, NaN inside gaps."""
    steps = np.diff(time)
    gaps = steps > GAP * period
    if gaps.any():
        notes.append(f"{int(np.sum(gaps))} gaps, {float(np.sum(steps[gaps])):.3g} s in all")
    uneven = np.abs(steps - period) > IRREGULAR * period
    if not uneven.any():
        return time, columns
    if not gaps.all() and uneven[~gaps].any():
        notes.append(f"irregular time; resampled to {period * 1e3:.3g} ms")
    grid = time[0] + period * np.arange(int((time[-1] - time[0]) / period + 1e-6) + 1)
    before = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(time) - 2)
    hole = gaps[before] & (grid - time[before] > 0.5 * period)
    hole &= time[before + 1] - grid > 0.5 * period
    out = {}
    for name, values in columns.items():
        if name == SET_POINT:
            out[name] = values[before]
            continue
        good = np.isfinite(values)
        line = np.interp(grid, time[good], values[good]) if good.any() else grid * np.nan
        out[name] = np.where(hole | ~good[before], np.nan, line)
    return grid, out


def _held(current: Array, notes: list[str]) -> Array:
    """Return a set point without holes: it holds until the next one."""
    good = np.isfinite(current)
    if good.all() or not good.any():
        return np.zeros(0) if not good.any() else current
    notes.append(f"{SET_POINT}: {int(np.sum(~good))} missing values were held")
    last = np.maximum.accumulate(np.where(good, np.arange(len(current)), 0))
    return np.asarray(current[last])


def _inspect(columns: dict[str, Array], notes: list[str]) -> None:
    """Report dead, stuck and implausible channels; drop the dead ones."""
    for name in list(columns):
        values = columns[name][np.isfinite(columns[name])]
        if not len(values):
            continue
        spread = float(np.ptp(values))
        if spread < DEAD * SPANS[name]:
            notes.append(f"{name}: constant at {values[0]:.6g}; the channel is dead, not used")
            del columns[name]
            continue
        if np.median(np.abs(values)) > BEYOND * SPANS[name]:
            notes.append(f"{name}: far beyond a usual range; is its unit right?")
        top, bottom = np.mean(values == values.max()), np.mean(values == values.min())
        if max(top, bottom) > STUCK and len(np.unique(values)) > 20:
            notes.append(f"{name}: {100 * max(top, bottom):.0f} % at one extreme; saturated?")
