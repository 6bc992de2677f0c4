"""A file of several experiments: its time starts again, or its logger paused."""

from dataclasses import replace

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array, Mask
from hil_emulator.identify.measured.grid import FEWEST_SAMPLES, GAP
from hil_emulator.identify.measured.reading import SET_POINT, MeasuredFile, Series

RESTART_PERIODS = 20.0
"""Sample periods by which time falls back where a logger was started again; rows that were written
in the wrong order fall back by fewer (assumed), and to a time that no other row has."""

SAME_TIME = 0.25
"""Periods by which two rows of the same time differ at most (assumed)."""


def pieces(recording: MeasuredFile) -> list[MeasuredFile]:
    """Return the experiments of a recording, in their order; those too short are left out.

    Channels with clocks of their own stay together: which pieces belong to each other, the file
    does not say.

    Raises:
        UserError: if pauses leave no piece that is long enough.

    """
    times = {id(s.time): s.time for s in recording.series.values()}
    if len(times) != 1:
        return [recording]
    starts = _restarts(_time(recording))
    parts = _split(recording, starts, "time starts again")
    if len(parts) < len(starts) / 2:  # rows in disorder are put in order later
        parts = [recording]
    return [piece for part in parts for piece in _without_pauses(part)]


def _without_pauses(recording: MeasuredFile) -> list[MeasuredFile]:
    """Return what was recorded between pauses: what the set point was in one, nobody knows."""
    starts = _after_pauses(recording)
    parts = _split(recording, starts, "rows are missing for a while")
    if not parts and len(starts) > 1:
        raise UserError(
            f"{recording.file}{recording.part}: {len(starts) - 1} times rows are missing and the "
            f"set point is another one then; none of the parts has the {FEWEST_SAMPLES} samples "
            "that are needed"
        )
    return parts or [recording]


def _split(recording: MeasuredFile, starts: list[int], why: str) -> list[MeasuredFile]:
    """Return the parts that begin at some rows and are long enough, with a note in the first."""
    if len(starts) == 1:
        return [recording]
    ends = [*starts[1:], len(_time(recording))]
    long = [(a, b) for a, b in zip(starts, ends, strict=True) if b - a >= FEWEST_SAMPLES]
    times = "once" if len(starts) == 2 else f"{len(starts) - 1} times"
    note = f"{why} {times}; each part is an experiment"
    if len(long) < len(starts):
        note += f", {len(starts) - len(long)} with less than {FEWEST_SAMPLES} samples left out"
    return [
        replace(
            _part(recording, a, b),
            part=f"{recording.part}#{i + 1}",
            notes=(*recording.notes, note) if i == 0 else (),
        )
        for i, (a, b) in enumerate(long)
    ]


def _restarts(time: Array) -> list[int]:
    """Return the rows at which time begins, and begins again."""
    good = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[good])
    forward = steps[steps > 0.0]
    if not len(forward):
        return [0]
    period = float(np.median(forward))
    back = steps < -RESTART_PERIODS * period
    back |= (steps < 0.0) & _repeated(time[good], SAME_TIME * period)[1:]
    return [0, *good[1:][back].tolist()]


def _repeated(time: Array, least: float) -> Mask:
    """Tell which rows have a time that another row has, too."""
    order = np.argsort(time)
    same = np.diff(time[order]) < least
    found = np.zeros(len(time), np.bool_)
    found[order] = np.append(same, False) | np.append(False, same)
    return found


def _after_pauses(recording: MeasuredFile) -> list[int]:
    """Return the rows at which recording begins, and goes on where the set point got lost.

    It did where it is another one after a gap, or the gap is as long as an experiment.
    """
    time = _time(recording)
    good = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[good])
    if SET_POINT not in recording.series or np.any(steps < 0.0) or not np.any(steps):
        return [0]
    values, period = recording.series[SET_POINT].values[good], float(np.median(steps[steps > 0.0]))
    changed = values[1:] != values[:-1]
    lost = (steps > FEWEST_SAMPLES * period) | (changed & (steps > GAP * period))
    return [0, *good[1:][lost].tolist()]


def _time(recording: MeasuredFile) -> Array:
    return next(iter(recording.series.values())).time


def _part(recording: MeasuredFile, first: int, last: int) -> MeasuredFile:
    time = _time(recording)[first:last]
    series = {n: Series(time, s.values[first:last]) for n, s in recording.series.items()}
    return replace(recording, series=series)
