"""Currents of a valve relative to its rated current: bounds, typical sizes and defaults."""

import math
from collections.abc import Mapping
from dataclasses import replace

from hil_emulator.model.declare import Param

REFERENCE_CURRENT = 0.01
"""Rated current at which the declarations of the valve hold [A] (Moog E024 in public HyQ scripts).
"""

TABLES = ("valve", "driver")
"""The configuration tables whose currents are relative to the rated current."""

_FULLY_OPEN = ("spool_stops_limit", "current_saturation_limit")
"""Fields that hold the current of full opening; by default the stops are there."""

_POWERS = {"A": 1, "A/s": 1, "m/A": -1}


def depends(param: Param) -> bool:
    """Return whether the bounds of a number of the valve depend on the rated current."""
    return param.unit in _POWERS


def scale(param: Param, rated: float) -> float:
    """Return the factor of a declared number of the valve at a rated current [A].

    Currents and rates of current are proportional to the rated current, numbers per ampere
    inversely proportional.
    """
    return float((rated / REFERENCE_CURRENT) ** _POWERS.get(param.unit, 0))


def at_rated_current(param: Param, rated: float) -> Param:
    """Return a declaration of the valve at a rated current [A]."""
    times = scale(param, rated)
    if times == 1.0:
        return param
    return replace(
        param, typical=times * param.typical, low=times * param.low, high=times * param.high,
        default=None if param.default is None else times * param.default,
    )  # fmt: skip


def sized(param: Param, table: str, rated: float) -> Param:
    """Return a declaration of any table at a rated current [A]."""
    return at_rated_current(param, rated) if table in TABLES else param


def rated_current(values: Mapping[str, float]) -> float:
    """Return the current of full opening [A]: that of the spool's stops, or the driver's limit.

    Args:
        values: parameters by field name, SI; without both the result is the reference's.

    """
    limits = (values.get(field, math.inf) for field in _FULLY_OPEN)
    return next((float(limit) for limit in limits if math.isfinite(limit)), REFERENCE_CURRENT)
