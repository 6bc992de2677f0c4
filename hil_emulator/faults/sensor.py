"""Sensor faults: wrong readings of a channel.

Each is a function of the strength s that changes the sample in place: value + s (wrong - value).
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from hil_emulator.faults.declare import (
    SPAN,
    SPAN_PER_SECOND,
    TEXT,
    FaultKind,
    FaultParam,
    Layer,
)
from hil_emulator.faults.strength import Strength
from hil_emulator.model.sensors import CHANNELS

Values = list[float]
Ranges = list[int]
Act = Callable[[Strength, Values, Ranges], None]
"""Changes values and over-range flags of one sample."""
Wrong = Callable[[Strength, float], float]
"""Returns the wrong reading for a right one."""


class Place(NamedTuple):
    """Place of a faulty channel in the samples.

    Attributes:
        at: its position.
        upper: upper end of its measuring range.
        channels: all channels, by position.
        unpowered: reading that the input shows for no current or voltage.

    """

    at: int
    upper: float
    channels: tuple[str, ...]
    unpowered: float


@dataclass(frozen=True)
class SensorFaultKind(FaultKind):
    """A kind of fault of a sensor or its cable."""

    layer = Layer.SENSOR
    given = ("place",)
    begin: Callable[..., Act]


_ALL = tuple(c.name for c in CHANNELS)
_WITH_TWIN = tuple(
    c.name for c in CHANNELS if any(o.unit == c.unit and o.name != c.name for o in CHANNELS)
)


def sensor_fault(
    *params: FaultParam, targets: tuple[str, ...] = _ALL, probability: float = 1.0
) -> Callable[[Callable[..., Act]], SensorFaultKind]:
    """Declare the decorated function as a fault of channels."""

    def declare(begin: Callable[..., Act]) -> SensorFaultKind:
        return SensorFaultKind(begin, targets, params, probability)

    return declare


def _blended(place: Place, wrong: Wrong, overrange: int = 0) -> Act:
    at = place.at

    def act(strength: Strength, values: Values, ranges: Ranges) -> None:
        bad = wrong(strength, values[at])
        share = strength.drawn()
        values[at] = bad if share == 1.0 else values[at] + share * (bad - values[at])
        if overrange and share:
            ranges[at] = overrange

    return act


@sensor_fault()
def off(place: Place) -> Act:
    """No signal: reads 0, reported as below its range."""
    return _blended(place, lambda s, v: 0.0, overrange=-1)


@sensor_fault()
def wire_break(place: Place) -> Act:
    """The wire breaks: 0 mA or 0 V, with a live zero below 3.6 mA (NAMUR NE 43)."""
    return _blended(place, lambda s, v: place.unpowered, overrange=-1)


@sensor_fault()
def stuck(place: Place) -> Act:
    """Keeps its present reading."""
    kept: list[float] = []

    def wrong(s: Strength, value: float) -> float:
        if not kept:
            kept.append(value)
        return kept[0]

    return _blended(place, wrong)


@sensor_fault(FaultParam("value", SPAN, "amount that is added to the reading", 0.1, -10.0, 10.0))
def offset(place: Place, value: float) -> Act:
    """Reads a value with an offset."""
    return _blended(place, lambda s, v: v + value)


@sensor_fault(FaultParam("factor", "1", "factor on the reading", 1.2, -10.0, 10.0))
def gain(place: Place, factor: float) -> Act:
    """Multiplies its reading."""
    return _blended(place, lambda s, v: v * factor)


@sensor_fault(FaultParam("rate", SPAN_PER_SECOND, "rate of the drift", 0.1, -100.0, 100.0))
def drift(place: Place, rate: float) -> Act:
    """Wanders off."""
    return _blended(place, lambda s, v: v + rate * s.elapsed_ns * 1e-9)


@sensor_fault(
    FaultParam("deviation", SPAN, "standard deviation of the additional noise", 0.02, 0.0, 10.0)
)
def noise(place: Place, deviation: float) -> Act:
    """Reads with additional normal noise."""
    return _blended(place, lambda s, v: v + s.random.gauss(0.0, deviation))


@sensor_fault(
    FaultParam("amplitude", SPAN, "amplitude of the sine", 0.02, 0.0, 10.0),
    FaultParam("frequency", "Hz", "frequency of the mains", 50.0, 0.1, 10e3),
)
def hum(place: Place, amplitude: float, frequency: float) -> Act:
    """The cable picks up the mains: a sine on top of its reading."""
    turning = 2.0 * math.pi * frequency * 1e-9  # [rad/ns]
    return _blended(place, lambda s, v: v + amplitude * math.sin(turning * s.elapsed_ns))


@sensor_fault(
    FaultParam("height", SPAN, "amount that is added to a sample", 0.3, -10.0, 10.0),
    probability=0.02,
)
def spike(place: Place, height: float) -> Act:
    """Single samples have an additional height."""
    return _blended(place, lambda s, v: v + height)


@sensor_fault(FaultParam("time", "s", "delay of the reading", 0.02, 0.0, 10.0, "ms"))
def delay(place: Place, time: float) -> Act:
    """Shows an earlier reading; at first the last one before the fault."""
    time_ns = round(time * 1e9)
    past: deque[tuple[int, float]] = deque()

    def wrong(s: Strength, value: float) -> float:
        past.append((s.now_ns, value))
        while len(past) > 1 and past[1][0] <= s.now_ns - time_ns:
            past.popleft()
        return past[0][1]

    return _blended(place, wrong)


@sensor_fault(probability=0.5)
def dropout(place: Place) -> Act:
    """Single samples are lost; the one before is repeated."""
    at = place.at
    good: list[Any] = []

    def act(s: Strength, values: Values, ranges: Ranges) -> None:
        if good and s.hits():
            values[at], ranges[at] = good
        else:
            good[:] = values[at], ranges[at]

    return act


@sensor_fault()
def over_range(place: Place) -> Act:
    """At the upper end of its range, and reported."""
    return _blended(place, lambda s, v: place.upper, overrange=1)


@sensor_fault(
    FaultParam("channel", TEXT, "channel that it is exchanged with", None),
    targets=_WITH_TWIN,
)
def swapped(place: Place, channel: str) -> Act:
    """Exchanged with another channel."""
    at, other = place.at, place.channels.index(channel)

    def act(s: Strength, values: Values, ranges: Ranges) -> None:
        if s.drawn():
            values[at], values[other] = values[other], values[at]
            ranges[at], ranges[other] = ranges[other], ranges[at]

    return act


KINDS = (
    off, wire_break, stuck, offset, gain, drift, noise, hum, spike, delay, dropout, over_range,
    swapped,
)  # fmt: skip
