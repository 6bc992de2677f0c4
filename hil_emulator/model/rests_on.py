"""Dependence of numbers on defaults."""

import math
from collections.abc import Mapping

NOTICEABLE = 0.1
"""Relative change of a number by one spread of a default above which the number depends on the
default (assumed)."""


def rests_on(
    numbers: Mapping[str, float], others: Mapping[str, Mapping[str, float]]
) -> dict[str, tuple[str, ...]]:
    """Return the defaults that each number depends on; independent numbers are left out.

    Args:
        numbers: by name.
        others: the numbers with one default changed, by the field of the default.

    """
    marks = {
        name: tuple(f for f, again in others.items() if _differs(value, again.get(name, value)))
        for name, value in numbers.items()
    }
    return {name: fields for name, fields in marks.items() if fields}


def _differs(value: float, other: float) -> bool:
    if not (math.isfinite(value) and math.isfinite(other)):
        return False
    return abs(other - value) > NOTICEABLE * abs(value)
