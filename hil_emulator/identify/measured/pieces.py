"""Files of several experiments: the time starts again, or the logger paused."""

from dataclasses import replace

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import Array, Index, Mask
from hil_emulator.identify.measured.grid import FEWEST_SAMPLES, GAP
from hil_emulator.identify.measured.reading import MeasuredFile, Series

RESTART_PERIODS = 20.0
"""Number of sample periods by which time falls back when a logger starts again. Rows in the wrong
order fall back by fewer (assumed), and to a time that no other row has."""

SAME_TIME = 0.25
"""Largest difference of the times of two simultaneous rows, in periods (assumed)."""


LONG_PAUSE = 60.0
"""Length of a pause that separates experiments without a set point [s] (assumed)."""

MOST_STRAYS = 0.1
"""Largest share of rows whose time may be far from all others (assumed)."""


def pieces(recording: MeasuredFile) -> list[MeasuredFile]:
    """Return the experiments of a recording, in their order; those too short are left out.

    A file does not state which pieces of channels with separate clocks belong together. Such
    channels are divided only at a pause of all clocks.

    Raises:
        UserError: if pauses leave no piece that is long enough.

    """
    recording = _without_strays(recording)
    if len(_clocks(recording)) != 1:
        return _without_pauses(recording)
    starts = _restarts(_time(recording))
    parts = _split(recording, starts, "time starts again")
    if len(parts) < len(starts) / 2:  # rows in the wrong order; `grid.ordered` sorts them
        parts = [recording]
    return [piece for part in parts for piece in _without_pauses(part)]


def _without_strays(recording: MeasuredFile) -> MeasuredFile:
    """Return a recording without single rows whose time is far from that of all others."""
    cuts, clocks = _cuts(recording), _clocks(recording)
    strays = np.flatnonzero(_sizes(clocks, cuts) == 1)
    if not len(strays) or len(strays) > MOST_STRAYS * max(map(len, clocks)):
        return recording
    kept = _kept(recording, cuts, np.setdiff1d(np.arange(-1, len(cuts) + 1), strays))
    times = np.concatenate([time[np.isin(_spans(time, cuts), strays)] for time in clocks])
    listed = ", ".join(f"{t:.6g}" for t in np.unique(times)[:4])
    more = ", ..." if len(strays) > 4 else ""
    note = f"rows with a time far from all others, left out: {len(strays)} ({listed}{more} s)"
    return replace(kept, notes=(*recording.notes, note))


def _without_pauses(recording: MeasuredFile) -> list[MeasuredFile]:
    """Return the parts between pauses, during which the set point is unknown."""
    cuts = _cuts(recording)
    if not len(cuts):
        return [recording]
    long = np.flatnonzero(_sizes(_clocks(recording), cuts) >= FEWEST_SAMPLES)
    if not len(long):
        raise UserError(
            f"{recording.file}{recording.part}: {len(cuts)} times rows are missing, for long or "
            f"with another set point then; no part has the {FEWEST_SAMPLES} samples "
            "that are needed"
        )
    parts = [_kept(recording, cuts, np.array([i])) for i in long]
    return _numbered(recording, parts, len(cuts) + 1, "rows are missing for a while")


def _split(recording: MeasuredFile, starts: list[int], why: str) -> list[MeasuredFile]:
    """Return the parts that begin at some rows and are long enough, with a note in the first."""
    if len(starts) == 1:
        return [recording]
    ends = [*starts[1:], len(_time(recording))]
    long = [(a, b) for a, b in zip(starts, ends, strict=True) if b - a >= FEWEST_SAMPLES]
    return _numbered(recording, [_part(recording, a, b) for a, b in long], len(starts), why)


def _numbered(
    recording: MeasuredFile, parts: list[MeasuredFile], count: int, why: str
) -> list[MeasuredFile]:
    """Return numbered parts; the first has a note on their number."""
    times = "once" if count == 2 else f"{count - 1} times"
    note = f"{why} {times}; each part is an experiment"
    if len(parts) < count:
        note += f", {count - len(parts)} with less than {FEWEST_SAMPLES} samples left out"
    return [
        replace(
            part,
            part=f"{recording.part}#{i + 1}",
            notes=(*recording.notes, note) if i == 0 else (),
        )
        for i, part in enumerate(parts)
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
    """Return whether each row has the time of another row."""
    order = np.argsort(time)
    same = np.diff(time[order]) < least
    repeated = np.zeros(len(time), np.bool_)
    repeated[order] = np.append(same, False) | np.append(False, same)
    return repeated


def _cuts(recording: MeasuredFile) -> Array:
    """Return the times after the gaps that separate experiments.

    A gap separates them if the set point changed in it, or if it is as long as an experiment.
    Without a set point only a long pause separates them.
    """
    clocks = _clocks(recording)
    time = np.unique(np.concatenate(clocks))
    time = time[np.isfinite(time)]
    steps = np.diff(time)
    period = max((_period(clock) for clock in clocks), default=0.0)
    if not len(steps) or not period:
        return np.zeros(0)
    lost = steps > FEWEST_SAMPLES * period
    series = recording.series.get(SET_POINT)
    if series is None:
        lost &= steps > LONG_PAUSE
    elif len(clocks) == 1:
        order = np.argsort(series.time, kind="stable")
        rows = order[np.searchsorted(series.time[order], time)]
        changed = series.values[rows[1:]] != series.values[rows[:-1]]
        lost |= changed & (steps > GAP * period)
    return time[1:][lost]


def _period(time: Array) -> float:
    """Return the usual step of a clock; 0 if time never increases."""
    good = time[np.isfinite(time)]
    steps = np.diff(good)
    forward = steps[steps > 0.0]
    return float(np.median(forward)) if len(forward) else 0.0


def _clocks(recording: MeasuredFile) -> list[Array]:
    return list({id(s.time): s.time for s in recording.series.values()}.values())


def _spans(time: Array, cuts: Array) -> Index:
    """Return the number of cuts before each time; -1 for NaN."""
    span = np.searchsorted(cuts, time, side="right")
    return np.where(np.isfinite(time), span, -1)


def _sizes(clocks: list[Array], cuts: Array) -> Index:
    """Return the number of rows between cuts, of the clock with most rows."""
    spans = [_spans(time, cuts) for time in clocks]
    counts = [np.bincount(span[span >= 0], minlength=len(cuts) + 1) for span in spans]
    return np.asarray(np.max(counts, axis=0))


def _kept(recording: MeasuredFile, cuts: Array, wanted: Index) -> MeasuredFile:
    """Return the rows of some of the spans between cuts."""
    masks = {id(time): np.isin(_spans(time, cuts), wanted) for time in _clocks(recording)}
    times = {id(time): time[masks[id(time)]] for time in _clocks(recording)}
    series = {
        n: Series(times[id(s.time)], s.values[masks[id(s.time)]])
        for n, s in recording.series.items()
    }
    return replace(recording, series=series)


def _time(recording: MeasuredFile) -> Array:
    return next(iter(recording.series.values())).time


def _part(recording: MeasuredFile, first: int, last: int) -> MeasuredFile:
    time = _time(recording)[first:last]
    series = {n: Series(time, s.values[first:last]) for n, s in recording.series.items()}
    return replace(recording, series=series)
