"""What the digits of an object stand for: one digit, or two points of an analogue input or output.

unit = "0.1 mbar"                                                   # one digit
points = { "4 mA" = "0 bar", "20 mA" = "250 bar" }, digits = "1 uA"  # a live zero
points = { "5530" = "0 bar", "27648" = "250 bar" }                  # in digits
range = ["0 mA", "24 mA"]                                           # where the module saturates
"""

import math
from collections.abc import Mapping
from typing import Any

from hil_emulator.errors import brief
from hil_emulator.units import count, multiple, to_si

SCALES = ("unit", "points", "digits", "range")
"""Keys that scale a channel or a command."""

Ends = tuple[float, float]


def read_scale(table: Mapping[str, Any], unit: str, *, command: bool) -> dict[str, Any]:
    """Return the fields of `ObjectSettings` for the keys in `SCALES`.

    Args:
        table: with these keys.
        unit: SI unit of the channel or command.
        command: whether it is a command, whose points are also its limits.

    Raises:
        ValueError: a key has no such value, or contradicts another.

    """
    if "points" in table:
        if "unit" in table:
            raise ValueError("unit and points both state what a digit is; keep one")
        scale, ends = _two_points(table["points"], table.get("digits"), unit)
        settled: dict[str, Any] = scale | {"ends": ends if command else None}
    elif "digits" in table:
        raise ValueError("digits belongs to points; for one digit of a channel write unit")
    elif "unit" in table:
        factor, offset = multiple(table["unit"], unit)
        settled = {"unit": unit, "factor": factor, "offset": offset}
    else:
        settled = {}
    if "range" in table:
        settled["ends"] = _range(table["range"], table.get("digits"))
    return settled


def _two_points(points: Any, digit: Any, unit: str) -> tuple[dict[str, Any], Ends]:
    """Return the scale through two points, and their digits."""
    if not isinstance(points, Mapping) or len(points) != 2:
        raise ValueError('points are two: points = { "4 mA" = "0 bar", "20 mA" = "250 bar" }')
    (low, first), (high, second) = (
        (_digits(key, digit), to_si(value, unit)) for key, value in points.items()
    )
    if not math.isfinite(first) or not math.isfinite(second):
        raise ValueError("points are finite values")
    if low == high or first == second:
        raise ValueError("points are the same in digits or in value; give two different ones")
    factor = (second - first) / (high - low)
    ends = (min(low, high), max(low, high))
    return {"unit": unit, "factor": factor, "offset": first - factor * low}, ends


def _range(ends: Any, digit: Any) -> Ends:
    if not isinstance(ends, list) or len(ends) != 2:
        raise ValueError('range has two ends: range = ["0 mA", "24 mA"]')
    low, high = (_digits(end, digit) for end in ends)
    if low >= high:
        raise ValueError("range: the first end is the lower one")
    return low, high


def _digits(text: Any, digit: Any) -> float:
    """Return a number of digits: a quantity is counted in `digit`, without it a plain number."""
    try:
        number = float(text) if digit is None else count(text, str(digit))
    except (TypeError, ValueError) as error:
        if digit is not None:
            raise
        way = 'is a number of digits, or give digits = "1 uA"'
        raise ValueError(f"{brief(text)} {way}") from error
    if not math.isfinite(number):
        raise ValueError(f"{brief(text)} is not finite")
    return number
