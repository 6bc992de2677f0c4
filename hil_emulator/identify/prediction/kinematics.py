"""Velocity and acceleration of a measured position, by a smoother that takes its noise from data.

How noisy the position is, and how hard the jerk that moves it, are those two levels that make the
readings likeliest. Motion is uneven: a rod that reverses has jerks that one that goes on has not.
So the level of the jerk is then found for every moment, from what the smoother sees around it
(expectation maximisation; Dempster, Laird and Rubin 1977).
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize_scalar

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.rts_smoother import backwards, forwards

RANGE = (-40.0, 10.0)
"""Logarithm of the jerk over the noise, both as they act in one sample, between which it lies:
from a line through all samples to one through each."""

AROUND = 5
"""Samples that share a level of the jerk (assumed: fewer are chance, more smear a start)."""

PASSES = 8
"""Iterations by which that level has settled."""

FAINTEST = 1e-6
"""Least jerk over that of the whole recording (assumed): a rod at rest has none, but less
would leave little of the digits in which the smoother counts."""

FINEST = 1e-6
"""Least noise over the travel (assumed): finer than any position sensor."""


@dataclass(frozen=True)
class Motion:
    """Position, velocity and acceleration of a rod at every sample.

    Attributes:
        states: position [m], velocity [m/s], acceleration [m/s^2], shape (samples, 3).
        noise: standard deviation of the position's noise, rounding included [m].

    """

    states: Array
    noise: float


def motion(position: Array, period: float) -> Motion:
    """Return the motion behind readings of a position.

    Args:
        position: readings [m], NaN where missing, at least four of them not.
        period: of the samples [s].

    """
    centre = float(np.nanmean(position))
    noise, jerk = _levels(position - centre)
    readings = (position - centre) / noise
    level = np.full(len(readings), jerk)
    for _ in range(PASSES):
        found = _smoothed(readings, level)[1]
        around = uniform_filter1d(level * found, AROUND, mode="nearest")
        level = np.maximum(around, FAINTEST * jerk)
    states = _smoothed(readings, level)[0] * (noise / period ** np.arange(3))
    states[:, 0] += centre
    return Motion(states, noise)


def resolution(values: Array) -> float:
    """Return the step in which readings are rounded, or the least by which any two differ."""
    levels = np.unique(values[np.isfinite(values)])
    return float(np.min(np.diff(levels))) if len(levels) > 1 else 0.0


def _levels(position: Array) -> tuple[float, float]:
    """Return the standard deviation of the noise, and the jerk's density in one sample over it."""
    travel = float(np.nanmax(position) - np.nanmin(position))
    least = max(resolution(position) / np.sqrt(12.0), FINEST * travel, 1e-12)
    readings = position / least
    none = np.zeros((0, 3)), np.zeros((0, 3, 3))

    def judged(logarithm: float) -> tuple[float, float]:
        """Return the likeliest noise over the least there is, and twice minus log likelihood."""
        jerk = np.full(len(readings), np.exp(logarithm))
        logarithms, squares, count = forwards(readings, jerk, *none)
        variance = max(squares / count, 1.0)
        return variance, logarithms + count * np.log(variance) + squares / variance

    found = minimize_scalar(
        lambda x: judged(x)[1], bounds=RANGE, method="bounded", options={"xatol": 0.05}
    )
    return least * float(np.sqrt(judged(found.x)[0])), float(np.exp(found.x))


def _smoothed(readings: Array, jerk: Array) -> tuple[Array, Array]:
    """Return states, and the jerk found over that assumed."""
    count = len(readings)
    states, covariances = np.zeros((count, 3)), np.zeros((count, 3, 3))
    found = np.ones(count)
    forwards(readings, jerk, states, covariances)
    backwards(readings, jerk, states, covariances, found)
    return states, found
