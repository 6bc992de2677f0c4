"""Check of expectations against a recording."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hil_emulator.frame import Frame
from hil_emulator.recording.memory import MemoryRecorder
from hil_emulator.recording.messages import describe
from hil_emulator.scenario.outcome import Check, Curve, Span
from hil_emulator.scenario.schema import Expect
from hil_emulator.signals.columns import columns
from hil_emulator.units import show

Flags = np.ndarray[Any, np.dtype[np.bool_]]

_DATA_BYTES = 8  # of a classical frame
SHOWN = {"Pa": "bar", "m": "mm", "A": "mA", "m/s": "mm/s"}
"""Units in which engineers read signals, by their SI unit."""


def judge(expectations: Sequence[Expect], recorder: MemoryRecorder) -> tuple[Check, ...]:
    """Return a check for each expectation."""
    table = recorder.table()
    return tuple(
        _frames(e, recorder.frames) if e.signal is None else _signal(e, table) for e in expectations
    )


def bands(
    expectations: Sequence[Expect], table: Mapping[str, Curve], duration: float
) -> Iterator[Span]:
    """Yield the spans in which signals are expected in a scenario of some duration [s].

    A signal with a latest time is expected from the time at which it first enters its band.
    """
    for e in expectations:
        if e.signal is None or e.within is None:
            continue
        low, high = e.within
        begin, end = e.start, e.until
        if e.by is not None:
            values = table[e.signal]
            reached = _reaching(e, table["time"], (values >= low) & (values <= high))
            begin = e.by if reached is None else reached
            end = None if e.lasting is None else begin + e.lasting
        yield Span(begin, duration if end is None else end, "expected", e.signal, (low, high))


def _amount(name: str, value: float) -> str:
    unit = columns()[name]
    return show(value, unit, SHOWN.get(unit, unit))


def _signal(e: Expect, table: dict[str, Curve]) -> Check:
    assert e.signal is not None
    assert e.within is not None
    low, high = e.within
    band = f"{e.signal} in {_amount(e.signal, low)} ... {_amount(e.signal, high)}"
    time, values = table["time"], table[e.signal]
    inside = (values >= low) & (values <= high)
    if e.by is not None:
        return _reached(e, band, time, inside)
    until = time[-1] if e.until is None else e.until
    window = (time >= e.start) & (time <= until)
    text = f"{band} from {e.start:g} s to {until:g} s"
    if not window.any():
        return Check(text, False, "no sample there")
    extremes = (float(values[window].min()), float(values[window].max()))
    extent = " ... ".join(_amount(e.signal, v) for v in extremes)
    return Check(text, bool(inside[window].all()), extent)


def _reached(e: Expect, band: str, time: Curve, inside: Flags) -> Check:
    """Check that the signal is in its band by a time, and stays there."""
    assert e.by is not None
    text = f"{band} by {e.by:g} s"
    if e.lasting is not None:
        text += f" for {e.lasting:g} s"
    reached = _reaching(e, time, inside)
    return Check(text, reached is not None, "never" if reached is None else f"at {reached:.3f} s")


def _reaching(e: Expect, time: Curve, inside: Flags) -> float | None:
    """Return when a signal enters its band to stay for the required time; None if never."""
    assert e.by is not None
    for begin in np.flatnonzero(inside & (time >= e.start)):
        if time[begin] > e.by:
            break
        end = time[-1] if e.lasting is None else time[begin] + e.lasting
        if inside[(time >= time[begin]) & (time <= end)].all() and time[-1] >= end - 1e-9:
            return float(time[begin])
    return None


def _frames(e: Expect, frames: Sequence[tuple[int, bool, Frame]]) -> Check:
    assert e.frame is not None
    until = float("inf") if e.until is None else e.until
    wanted = bytes.fromhex(e.data)
    times = [
        now_ns * 1e-9
        for now_ns, sent, frame in frames
        if frame.can_id == e.frame
        and frame.data.startswith(wanted)
        and sent
        and e.start <= now_ns * 1e-9 <= until
    ]
    what = f"frame {e.frame:03X}" + (f" {e.data}" if e.data else "")
    words = describe(Frame(e.frame, wanted.ljust(_DATA_BYTES, b"\0") if wanted else b""), {})
    what += f" ({words.partition('  ')[0]})" if words else ""
    text = f"{what} {'seen' if e.seen else 'not seen'} from {e.start:g} s" + (
        "" if e.until is None else f" to {e.until:g} s"
    )
    times_seen = f"{len(times)}, first at {times[0]:.3f} s" if times else "none"
    return Check(text, bool(times) == e.seen, times_seen)
