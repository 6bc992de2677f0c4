"""Frames that belong to one sample of the device, and the set point that led to it."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.captures.traffic import Places, Stream
from hil_emulator.errors import UserError
from hil_emulator.identify.measured.channel_names import SET_POINT
from hil_emulator.identify.measured.experiment import Array

DRIFT = 0.02
"""Relative change of the period that no clock of a device makes (crystals: 1e-4)."""

FOLLOWS = 0.2
"""Part of a period within which frames of one sample keep their distance (assumed)."""

SEGMENTS = 8
"""Parts of a capture in which its period is compared."""

FEWEST = 50
"""Frames from which a period can be told (assumed)."""

PAUSE = 1.7
"""Usual steps from which a step is no longer a late frame but more than one sample."""

LONG_PAUSE = 60.0
"""Pause without frames of the reference that parts a capture [s] (assumed)."""

PHASE_LOCK = 0.05
"""Part of a frame's deviation by which the expected phase follows it."""


def period_of(reference: Stream, notes: list[str]) -> float:
    """Return the period of the samples by the capture's own clock [s]; report its jitter.

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
            f"{np.median(late) * 1e3:.2g} ms, the worst {late.max() * 1e3:.3g} ms beside it; "
            "samples are told by their order"
        )
    return stated or period


def _mean(steps: Array, usual: float) -> float:
    """Return the mean step; a lost frame, or a device that stood still, is none."""
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
    """Leave out what lies in long pauses, where a table would hold nothing.

    Args:
        number: of the sample of each frame of the reference.
        period: of the samples [s].

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
    """Count the periods that pass, with an expected phase that follows slow drifts."""
    number = np.zeros(len(time), np.int64)
    expected = time[0]
    for i in range(1, len(time)):
        passed = max(1, round((time[i] - expected) / period))
        number[i] = number[i - 1] + passed
        expected += passed * period
        expected += PHASE_LOCK * (time[i] - expected)
    return number


def joined(stream: Stream, reference: Stream, number: Places, notes: list[str]) -> Places | None:
    """Return the number of the sample of each frame; None where a device has its own rhythm."""
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
    """Return the set point that acted before each sample, NaN where it is not known.

    Args:
        stream: the frames that carry it.
        key: of its value.
        first: place of the first frame of each sample; -1 for a lost one.
        time: of each sample by the capture's clock [s].
        syncs: places of the SYNC frames.
        notes: takes what was found.

    """
    place, values, since = stream.place, stream.values[key], stream.time
    if stream.carrier.synchronous:
        after = np.searchsorted(syncs, place)
        inside = after < len(syncs)
        place, values, since = syncs[after[inside]], values[inside], since[inside]
    known = np.maximum.accumulate(first)  # a lost sample: nothing is known to have changed
    before = np.searchsorted(place, known) - 1
    last = np.maximum(before, 0)
    found = np.where(before >= 0, values[last], np.nan)
    limit, safe = stream.carrier.deadline, stream.carrier.safe
    silent = (time - since[last] > limit) & (before >= 0) if limit else np.zeros(len(found), bool)
    found[silent] = np.nan
    replaced = int(np.sum(~np.isfinite(found)))
    if safe is not None and replaced:
        notes.append(
            f"{SET_POINT}: for {replaced} samples there was no valid one, so {safe:.3g} acted, "
            "the device's safe value"
        )
        found[~np.isfinite(found)] = safe
    return np.asarray(found)


def first_places(numbers: Sequence[tuple[Stream, Places]], rows: int) -> Places:
    """Return the place of the first frame of each sample; -1 for a lost one."""
    first = np.full(rows, np.iinfo(np.int64).max)
    for stream, number in numbers:
        inside = (number >= 0) & (number < rows)
        np.minimum.at(first, number[inside], stream.place[inside])
    first[first == np.iinfo(np.int64).max] = -1
    return first
