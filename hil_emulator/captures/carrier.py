"""Frames that carry channels, as a message database or an object dictionary describes them."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from hil_emulator.identify.measured.channel_names import KNOWN, TIME, fits

COUNTER = "sample_counter"
"""Signal with the device's count of samples, if it sends one; gaps in it show lost frames."""

_WORD = re.compile(r"[ _]")


@dataclass(frozen=True)
class Signal:
    """One value in a frame.

    Attributes:
        name: name of the channel; the source's name if the signal is not a channel.
        unit: unit of the value; "1" for a plain number, None if the source has no unit.
        key: key of the value in the result of the carrier's `decode`.
        names: names of values that are not readings, such as "Error", by value.
        range: smallest and largest value of a reading.

    """

    name: str
    unit: str | None
    key: str
    names: Mapping[float, str] = field(default_factory=dict)
    range: tuple[float, float] = (-math.inf, math.inf)


@dataclass(frozen=True)
class Carrier:
    """The frames of one COB-ID.

    Attributes:
        name: name for messages, such as "TPDO1 of node 5".
        can_id: CAN identifier of the frames.
        extended: whether the identifier has 29 bits.
        size: smallest length of a frame [B].
        signals: signals in a frame.
        decode: returns the values in a frame by key, without signals that the frame does not hold.
        synchronous: whether a set point in a frame acts at the next SYNC.
        deadline: time without a new set point after which the device uses a safe one [s]; 0 if it
            has no such time.
        safe: set point that acts without a valid one, in the signal's unit; None if unknown.
        period: period of the device's event timer [s]; 0 if unknown.
        counter_modulus: modulus of the sample counter; 0 without a counter.
        any_source: whether frames of the parameter group from another J1939 source address are
            frames of this carrier.

    """

    name: str
    can_id: int
    extended: bool
    size: int
    signals: tuple[Signal, ...]
    decode: Callable[[bytes], Mapping[str, float]]
    synchronous: bool = False
    deadline: float = 0.0
    safe: float | None = None
    period: float = 0.0
    counter_modulus: int = 0
    any_source: bool = False


def channel_of(name: str, unit: str) -> str:
    """Return the channel of a signal such as `pressure_a PV 16bit`; else the signal's name.

    A signal is a channel if its name begins with the channel's name as whole words and its unit
    has the channel's dimension. Net values, from which a tare was subtracted, are not readings.
    """
    if name in KNOWN or "net" in _WORD.split(name):
        return name
    longest = sorted((n for n in KNOWN if n != TIME), key=len, reverse=True)
    for channel in longest:
        if name.startswith(channel) and _WORD.match(name[len(channel) :]) and fits(channel, unit):
            return channel
    return name
