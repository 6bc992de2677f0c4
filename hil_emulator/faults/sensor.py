"""Sensor faults: what a channel reports in place of its reading.

Each is a function of the strength s that changes the sample in place: value + s (wrong - value).
"""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hil_emulator.faults.fault import Fault
from hil_emulator.faults.strength import Strength

Values = list[float]
Ranges = list[int]
Act = Callable[[Strength, Values, Ranges], None]
"""Changes values and over-range flags of one sample."""
Wrong = Callable[[Strength, float], float]
"""Returns the wrong reading in place of a right one."""


def act(fault: Fault, channels: Sequence[str], upper: Mapping[str, float]) -> Act:
    """Return what a fault does to samples.

    Args:
        fault: a fault of the sensor layer.
        channels: names of the channels, in the order of the samples.
        upper: upper end of each channel's measuring range, SI.

    """
    at, values = channels.index(fault.target), fault.values
    match fault.kind.name:
        case "off":
            return _blended(at, lambda s, v: 0.0, overrange=-1)
        case "over_range":
            return _blended(at, lambda s, v: upper[fault.target], overrange=1)
        case "stuck":
            return _blended(at, _stuck())
        case "offset":
            return _blended(at, lambda s, v: v + values["value"])
        case "gain":
            return _blended(at, lambda s, v: v * values["factor"])
        case "drift":
            return _blended(at, lambda s, v: v + values["rate"] * s.elapsed_ns * 1e-9)
        case "noise":
            return _blended(at, lambda s, v: v + s.random.gauss(0.0, values["deviation"]))
        case "spike":
            return _blended(at, lambda s, v: v + values["height"])
        case "delay":
            return _blended(at, _delay(round(values["time"] * 1e9)))
        case "dropout":
            return _dropout(at)
        case "swapped":
            return _swapped(at, channels.index(values["channel"]))
        case name:
            raise AssertionError(name)


def _blended(at: int, wrong: Wrong, overrange: int = 0) -> Act:
    def act(strength: Strength, values: Values, ranges: Ranges) -> None:
        bad = wrong(strength, values[at])
        share = strength.drawn()
        values[at] = bad if share == 1.0 else values[at] + share * (bad - values[at])
        if overrange and share:
            ranges[at] = overrange

    return act


def _stuck() -> Wrong:
    kept: list[float] = []

    def wrong(strength: Strength, value: float) -> float:
        if not kept:
            kept.append(value)
        return kept[0]

    return wrong


def _delay(time_ns: int) -> Wrong:
    past: deque[tuple[int, float]] = deque()

    def wrong(strength: Strength, value: float) -> float:
        past.append((strength.now_ns, value))
        while len(past) > 1 and past[1][0] <= strength.now_ns - time_ns:
            past.popleft()
        return past[0][1]

    return wrong


def _dropout(at: int) -> Act:
    good: list[Any] = []

    def act(strength: Strength, values: Values, ranges: Ranges) -> None:
        if good and strength.hits():
            values[at], ranges[at] = good
        else:
            good[:] = values[at], ranges[at]

    return act


def _swapped(at: int, other: int) -> Act:
    def act(strength: Strength, values: Values, ranges: Ranges) -> None:
        if strength.drawn():
            values[at], values[other] = values[other], values[at]
            ranges[at], ranges[other] = ranges[other], ranges[at]

    return act
