"""Faults of single objects of a node: wrong values by SDO and PDO."""

import re
from collections.abc import Callable
from dataclasses import dataclass

from hil_emulator.faults.declare import FaultKind, FaultParam, Layer
from hil_emulator.faults.strength import Strength

OBJECT = "object"
"""Target for any object, such as 0x7130:1, of one node or of all that have it."""
EXAMPLE = "0x7130:1"
"""Notation of an object."""

_PLACE = re.compile(r"0x([0-9a-f]{4})(?::([0-9a-f]{1,2}))?", re.ASCII)
_FIRST = 0x1000
"""First index of an object; a smaller number is a COB-ID (CiA 301 7.4)."""
_MOST = 1e9

Wrong = Callable[[Strength, float], float]
"""Returns the wrong digits for the right ones."""


def place(text: str) -> tuple[int, int] | None:
    """Return index and sub-index of an object such as 0x7130:1; None for any other text."""
    match = _PLACE.fullmatch(text)
    if match is None or int(match[1], 16) < _FIRST:
        return None
    return int(match[1], 16), int(match[2] or "0", 16)


@dataclass(frozen=True)
class ObjectFaultKind(FaultKind):
    """A kind of fault of an object."""

    layer = Layer.OBJECT
    begin: Callable[..., Wrong]


def object_fault(*params: FaultParam) -> Callable[[Callable[..., Wrong]], ObjectFaultKind]:
    """Declare the decorated function as a fault of objects."""

    def declare(begin: Callable[..., Wrong]) -> ObjectFaultKind:
        return ObjectFaultKind(begin, (OBJECT,), params)

    return declare


def _blended(s: Strength, sound: float, wrong: float) -> float:
    """Return the value between right and wrong, by the strength of the fault."""
    return sound + s.drawn() * (wrong - sound)


@object_fault()
def stuck() -> Wrong:
    """Keeps its present value."""
    kept: list[float] = []

    def wrong(s: Strength, value: float) -> float:
        if not kept:
            kept.append(value)
        return _blended(s, value, kept[0])

    return wrong


@object_fault(FaultParam("value", "1", "digits that are added", 100.0, -_MOST, _MOST))
def offset(value: float) -> Wrong:
    """Shows a value with an offset."""
    return lambda s, sound: _blended(s, sound, sound + value)


@object_fault(FaultParam("value", "1", "digits that are shown", 0.0, -_MOST, _MOST))
def constant(value: float) -> Wrong:
    """Shows a constant value."""
    return lambda s, sound: _blended(s, sound, value)


@object_fault(FaultParam("deviation", "1", "standard deviation in digits", 10.0, 0.0, _MOST))
def noise(deviation: float) -> Wrong:
    """Shows white noise on top of its value."""
    return lambda s, sound: _blended(s, sound, sound + s.random.gauss(0.0, deviation))


KINDS = (stuck, offset, constant, noise)
