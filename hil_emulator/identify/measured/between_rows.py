"""A set point that moved between the rows of its recording: how it may have, and how surely."""

from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from hil_emulator.identify.measured.experiment import Array, BetweenRows, Experiment

CONTROLLER = 1e-3
"""Period in which a controller sets the current, where its logger is slower [s] (assumed: that of
the emulator, and of many servo drives)."""

BRIDGE = 1.0 / 3.0
"""Variance of the mean between two known values over that in the middle: of a Brownian bridge."""

JUMP = 6.0
"""Usual deviations from a smooth curve beyond which a current jumped (assumed)."""


IMMATERIAL = 1e-3
"""Deviation over the largest current that is no jump: a null drifts by as much (assumed)."""


SetPoints = Literal["held", "moves", "unknown"]
"""What a set point did between the rows."""


def slower_than_controller(e: Experiment) -> bool:
    """Whether a controller may have set the current more than once from row to row."""
    return round(e.period / CONTROLLER) > 1


def moving(e: Experiment) -> Experiment:
    """Return an experiment whose current moves between its rows, along a curve through them.

    How far it may be from that curve is told by leaving out every other row.
    """
    parts = round(e.period / CONTROLLER)
    rows = np.arange(e.samples, dtype=np.float64)
    # a row has the first value of its period, or the last one of the period before
    values = np.append(e.current[:1], e.current[:-1]) if e.set_point_first else e.current
    ticks = np.arange(e.samples * parts) + (1.0 if e.set_point_first else 0.0)
    curve = _curve(rows, values, ticks / parts)
    far = _left_out(rows, values) ** 2
    # the median square of normal numbers
    usual = float(np.median(far)) / 0.6745**2
    ends = np.maximum(far, np.append(far[1:], far[-1]))
    least = (IMMATERIAL * float(np.max(np.abs(values)))) ** 2
    jumps = ends > JUMP**2 * max(usual, least)
    course = BetweenRows(curve.reshape(-1, parts), BRIDGE * np.maximum(ends, usual), jumps)
    return replace(e, course=course)


def _curve(rows: Array, values: Array, at: Array) -> Array:
    """Return a smooth curve through rows, which overshoots at no step; held at its ends."""
    inside = np.clip(at, rows[0], rows[-1])
    return np.asarray(Akima1DInterpolator(rows, values, method="makima")(inside))


def _left_out(rows: Array, values: Array) -> Array:
    """Return how far each row is from the curve through its neighbours, without itself."""
    far = np.zeros(len(rows))
    for odd in (0, 1):
        kept = np.arange(len(rows)) % 2 != odd
        far[~kept] = values[~kept] - _curve(rows[kept], values[kept], rows[~kept])
    return far
