"""Course of a set point between the rows of a log, with its uncertainty."""

from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from hil_emulator.identify.measured.experiment import Array, BetweenRows, Experiment

CONTROLLER = 1e-3
"""Period of the controller that sets the current of a slower log [s] (assumed: that of the emulator
and of many servo drives)."""

BRIDGE = 1.0 / 3.0
"""Ratio of the variance of the mean between two rows and the variance in the middle, for a Brownian
bridge."""

JUMP = 6.0
"""Ratio of a jump and the usual deviation from a smooth curve (assumed)."""


IMMATERIAL = 1e-3
"""Smallest jump relative to the largest current: the null drifts by as much (assumed)."""


SetPoints = Literal["held", "moves", "unknown"]
"""Course of a set point between the rows."""


def slower_than_controller(e: Experiment) -> bool:
    """Return whether a controller may have set the current more than once per row."""
    return round(e.period / CONTROLLER) > 1


def moving(e: Experiment) -> Experiment:
    """Return an experiment whose current moves between its rows, along a curve through them.

    The uncertainty of the curve follows from leaving out every other row.
    """
    parts = round(e.period / CONTROLLER)
    rows = np.arange(e.samples, dtype=np.float64)
    # a row holds the first value of its period, or the last value of the period before
    values = np.append(e.current[:1], e.current[:-1]) if e.set_point_first else e.current
    ticks = np.arange(e.samples * parts) + (1.0 if e.set_point_first else 0.0)
    curve = _curve(rows, values, ticks / parts)
    far = _left_out(rows, values) ** 2
    # 0.6745**2 is the median square of normal numbers
    usual = float(np.median(far)) / 0.6745**2
    ends = np.maximum(far, np.append(far[1:], far[-1]))
    least = (IMMATERIAL * float(np.max(np.abs(values)))) ** 2
    jumps = ends > JUMP**2 * max(usual, least)
    course = BetweenRows(curve.reshape(-1, parts), BRIDGE * np.maximum(ends, usual), jumps)
    return replace(e, course=course)


def _curve(rows: Array, values: Array, at: Array) -> Array:
    """Return a smooth curve through rows without overshoot at steps, constant beyond its ends."""
    inside = np.clip(at, rows[0], rows[-1])
    return np.asarray(Akima1DInterpolator(rows, values, method="makima")(inside))


def _left_out(rows: Array, values: Array) -> Array:
    """Return the distance of each row from the curve through its neighbours."""
    far = np.zeros(len(rows))
    for odd in (0, 1):
        kept = np.arange(len(rows)) % 2 != odd
        far[~kept] = values[~kept] - _curve(rows[kept], values[kept], rows[~kept])
    return far
