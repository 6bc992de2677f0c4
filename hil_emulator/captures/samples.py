"""Assignment of frames to samples of the device, and the set point before each sample."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.captures.traffic import Places, Stream
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import Array

DRIFT = 0.02
"""Relative change of the period that a device's clock does not reach (crystals: 1e-4)."""

FOLLOWS = 0.2
"""Largest jitter between frames of one sample, as a part of the period (assumed)."""

SEGMENTS = 8
"""Number of parts of a capture whose periods are compared."""

FEWEST = 50
"""Smallest number of frames for an estimate of the period (assumed)."""

PAUSE = 1.7
"""Step, in median steps, from which it is more than one sample and not a late frame."""

LONG_PAUSE = 60.0
"""Shortest pause without frames of the reference that is left out of the table [s] (assumed)."""

PHASE_LOCK = 0.05
"""Gain of the expected phase on a frame's deviation."""


def period_of(reference: Stream, notes: list[str]) -> float:
    """Return the period of the samples by the capture's clock [s]; append its jitter to `notes`.

    Raises:
        UserError: if there are too few frames, or the clock drifts.

    """
    name, time = reference.carrier.name, reference.time
    if len(time) < FEWEST:
        raise UserError(f"{len(time)} frames of {name}; at least {FEWEST} are needed")
    steps = np.diff(time)
    usual = float(np.median(steps))
    if usual <= 0.0:
        raise UserError(f"most frames of {name} have the time of the one before: no clock at all")
    period = _mean(steps, usual)
    parts = [_mean(part, usual) for part in np.array_split(steps, SEGMENTS)]
    unsure = 2.0 * float(np.std(steps[steps < PAUSE * usual])) / (len(steps) / SEGMENTS)
    if max(abs(p - period) for p in parts) > DRIFT * period + 2.0 * unsure:
        raise UserError(
            f"{name} comes every {min(parts) * 1e3:.4g} to {max(parts) * 1e3:.4g} ms in different "
            "parts of the capture: its clock drifts against the device's; record it again"
        )
    stated = reference.carrier.period
    if stated and abs(period / stated - 1.0) > DRIFT:
        raise UserError(
            f"two clocks: {name} comes every {period * 1e3:.4g} ms by the capture, and every "
            f"{stated * 1e3:g} ms by the device's event timer; record it with a clock that keeps "
            "time, or state the timer that the device had"
        )
    late = np.abs(steps - period)
    if late.max() > DRIFT * period:
        notes.append(
            f"{name} comes every {period * 1e3:.4g} ms, half of the times within "
            f"{np.median(late) * 1e3:.2g} ms, the worst {late.max() * 1e3:.3g} ms off; "
            "samples are counted in the order of their frames"
        )
    return stated or period


def _mean(steps: Array, usual: float) -> float:
    """Return the mean step, without steps over lost frames or pauses of the device."""
    short = steps[steps < PAUSE * usual]
    return float(np.mean(short)) if len(short) else usual


def numbers_of(reference: Stream, period: float, notes: list[str]) -> Places:
    """Return the number of the sample that each frame of the reference belongs to, from 0."""
    count = reference.count
    if count is not None:
        steps = np.diff(count)
        usual = max(1.0, float(np.median(steps)))
        number = _whole((count - count[0]) / usual)
    else:
        number = _by_time(reference.time, period)
    lost = int(number[-1]) + 1 - len(np.unique(number))
    if lost:
        notes.append(f"{lost} samples of {reference.carrier.name} are missing")
    return number


def without_pauses(number: Places, period: float) -> tuple[Places, Places]:
    """Leave out the samples in long pauses.

    Args:
        number: number of the sample of each frame of the reference.
        period: period of the samples [s].

    Returns:
        The row of each frame, and the number of the sample of each row.

    """
    steps = np.diff(number, prepend=number[:1])
    gone = np.cumsum(np.where(steps * period > LONG_PAUSE, steps - 1, 0))
    row = number - gone
    rows = np.arange(int(row[-1]) + 1)
    before = np.searchsorted(row, rows, side="right") - 1
    return row, rows + gone[before]


def _whole(values: Array) -> Places:
    number: Places = np.round(values).astype(np.int64)
    return number


def _by_time(time: Array, period: float) -> Places:
    """Count periods by time, with an expected phase that follows slow drifts."""
    number = np.zeros(len(time), np.int64)
    expected = time[0]
    for i in range(1, len(time)):
        passed = max(1, round((time[i] - expected) / period))
        number[i] = number[i - 1] + passed
        expected += passed * period
        expected += PHASE_LOCK * (time[i] - expected)
    return number


def joined(stream: Stream, reference: Stream, number: Places, notes: list[str]) -> Places | None:
    """Return the number of the sample of each frame; None if its period differs."""
    if stream is reference:
        return number
    count, theirs = stream.count, reference.count
    if count is not None and theirs is not None and _same_node(stream, reference):
        usual, modulus = max(1.0, float(np.median(np.diff(theirs)))), stream.carrier.counter_modulus
        apart = (count[0] - theirs[0] + modulus // 2) % modulus - modulus // 2
        return _whole((count - count[0] + apart) / usual)
    where = np.interp(stream.time, reference.time, number.astype(np.float64))
    part = where - np.round(where)
    turn = np.angle(np.mean(np.exp(2j * np.pi * part))) / (2.0 * np.pi)
    rest = np.mod(where - turn + 0.5, 1.0) - 0.5
    if float(np.quantile(np.abs(rest), 0.9)) > FOLLOWS:
        notes.append(
            f"{stream.carrier.name} keeps no fixed distance to {reference.carrier.name}: "
            "another rhythm, brought to its samples by interpolation"
        )
        return None
    return _whole(where - turn)


def _same_node(a: Stream, b: Stream) -> bool:
    return a.carrier.name.rpartition(" ")[2] == b.carrier.name.rpartition(" ")[2]


def set_points(
    stream: Stream, key: str, first: Places, time: Array, syncs: Places, notes: list[str]
) -> Array:
    """Return the set point that acted before each sample; NaN if unknown.

    Args:
        stream: frames that carry the set point.
        key: key of the set point's value.
        first: place of the first frame of each sample; -1 for a lost sample.
        time: time of each sample by the capture's clock [s].
        syncs: places of the SYNC frames.
        notes: remarks; a remark on replaced set points is appended.

    """
    place, values, since = stream.place, stream.values[key], stream.time
    if stream.carrier.synchronous:
        after = np.searchsorted(syncs, place)
        inside = after < len(syncs)
        place, values, since = syncs[after[inside]], values[inside], since[inside]
    latest = np.maximum.accumulate(first)  # a lost sample keeps the set point of the sample before
    before = np.searchsorted(place, latest) - 1
    last = np.maximum(before, 0)
    acting = np.where(before >= 0, values[last], np.nan)
    limit, safe = stream.carrier.deadline, stream.carrier.safe
    silent = (time - since[last] > limit) & (before >= 0) if limit else np.zeros(len(acting), bool)
    acting[silent] = np.nan
    replaced = int(np.sum(~np.isfinite(acting)))
    if safe is not None and replaced:
        notes.append(
            f"{SET_POINT}: for {replaced} samples there was no valid one, so {safe:.3g} acted, "
            "the device's safe value"
        )
        acting[~np.isfinite(acting)] = safe
    return np.asarray(acting)


def first_places(numbers: Sequence[tuple[Stream, Places]], rows: int) -> Places:
    """Return the place of the first frame of each sample; -1 for a lost sample."""
    first = np.full(rows, np.iinfo(np.int64).max)
    for stream, number in numbers:
        inside = (number >= 0) & (number < rows)
        np.minimum.at(first, number[inside], stream.place[inside])
    first[first == np.iinfo(np.int64).max] = -1
    return first
