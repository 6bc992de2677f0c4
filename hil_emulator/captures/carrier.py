"""Frames that carry channels, whatever says so."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from hil_emulator.identify.measured.channel_names import KNOWN, TIME, fits

COUNTER = "sample_counter"
"""A signal that counts the device's samples, if it sends one: it tells which frames are lost."""

_WORD = re.compile(r"[ _]")


@dataclass(frozen=True)
class Signal:
    """One value in a frame.

    Attributes:
        name: the channel; or as its source calls it, if that is no channel.
        unit: of the value; "1" for a plain number, None where the source states none.
        key: finds the value in what the carrier decodes.
        names: words for values that are no readings, such as "Error", by value.
        range: least and greatest value of a reading.

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
        name: for people, such as "TPDO1 of node 5".
        can_id: its identifier.
        extended: whether that has 29 bits.
        size: bytes that a frame must have.
        signals: what it carries.
        decode: returns values by key; leaves out what a frame does not hold.
        synchronous: whether a set point in it acts with the next SYNC only.
        deadline: time after which a device without a new set point takes a safe one [s]; 0: none.
        safe: what acts without a valid set point, in its unit; None where it is unknown.
        period: of the device's own timer [s]; 0 where it is unknown.
        counter_modulus: where the sample counter begins anew; 0 without one.
        any_source: whether a frame of another J1939 source address with the same parameter group
            is this one, too.

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
    """Return the channel that a signal such as `pressure_a PV 16bit` shows, else its own name.

    It begins with the channel's name as whole words, and its unit is of the channel's dimension;
    net values, from which something has been taken, are no readings.
    """
    if name in KNOWN or "net" in _WORD.split(name):
        return name
    longest = sorted((n for n in KNOWN if n != TIME), key=len, reverse=True)
    for known in longest:
        if name.startswith(known) and _WORD.match(name[len(known) :]) and fits(known, unit):
            return known
    return name
