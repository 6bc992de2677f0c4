"""A time column that starts again: a file of several experiments."""

from dataclasses import replace

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.measured.grid import FEWEST_SAMPLES
from hil_emulator.identify.measured.reading import MeasuredFile, Series

RESTART_PERIODS = 20.0
"""Sample periods by which time falls back where a logger was started again; rows that were written
in the wrong order fall back by fewer (assumed)."""


def pieces(recording: MeasuredFile) -> list[MeasuredFile]:
    """Return the experiments of a recording, in their order; those too short are left out.

    Channels with clocks of their own stay together: which pieces belong to each other, the file
    does not say.
    """
    times = {id(s.time): s.time for s in recording.series.values()}
    if len(times) != 1:
        return [recording]
    starts = _starts(next(iter(times.values())))
    ends = [*starts[1:], len(next(iter(times.values())))]
    long = [(a, b) for a, b in zip(starts, ends, strict=True) if b - a >= FEWEST_SAMPLES]
    if len(starts) == 1 or len(long) < len(starts) / 2:  # rows in disorder are put in order later
        return [recording]
    note = f"time starts again {len(starts) - 1} times; each part is an experiment"
    if len(long) < len(starts):
        note += f", {len(starts) - len(long)} with less than {FEWEST_SAMPLES} samples left out"
    return [
        replace(
            _part(recording, a, b),
            part=f"#{i + 1}",
            notes=(*recording.notes, note) if i == 0 else (),
        )
        for i, (a, b) in enumerate(long)
    ]


def _starts(time: Array) -> list[int]:
    """Return the rows at which time begins, and begins again."""
    good = np.flatnonzero(np.isfinite(time))
    steps = np.diff(time[good])
    forward = steps[steps > 0.0]
    if not len(forward):
        return [0]
    back = steps < -RESTART_PERIODS * float(np.median(forward))
    return [0, *good[1:][back].tolist()]


def _part(recording: MeasuredFile, first: int, last: int) -> MeasuredFile:
    time = next(iter(recording.series.values())).time[first:last]
    series = {n: Series(time, s.values[first:last]) for n, s in recording.series.items()}
    return replace(recording, series=series)
