"""Velocity and acceleration of a measured position, by a smoother that takes its noise from data.

How noisy the position is, and how hard the snap that moves it, are those two levels that make the
readings likeliest. Motion is uneven: a rod that reverses has snaps that one that goes on has not.
So the level of the snap is then found for every moment, from what the smoother sees around it
(expectation maximisation; Dempster, Laird and Rubin 1977).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.benches.rts_smoother import ORDER, backwards, forwards

TRIED = np.exp(np.arange(-60.0, 11.0, 2.0))
"""Densities of the snap over the noise, both as they act in one sample: from a parabola through all
samples to a line through each."""

AROUND = 5
"""Samples that share a level of the snap (assumed: fewer are chance, more smear a start)."""

PASSES = 8
"""Iterations by which that level has settled."""

FAINTEST = 1e-6
"""Least snap over that of the whole recording (assumed): a rod at rest has none, but less
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
        position: readings [m], NaN where missing.
        period: of the samples [s].

    """
    centre = float(np.nanmean(position))
    least = _least(position)
    noise, snap = _levels((position - centre) / least)
    level = np.full(len(position), snap)
    for _ in range(PASSES):
        found = _smoothed((position - centre) / (noise * least), level)
        around = uniform_filter1d(level * found.snap, AROUND, mode="nearest")
        before, noise = noise, max(noise * found.noise, 1.0)
        level = np.maximum(around, FAINTEST * snap) * (before / noise) ** 2
    noise *= least
    states = _smoothed((position - centre) / noise, level).states[:, :3]
    states *= noise / period ** np.arange(3)
    states[:, 0] += centre
    return Motion(states, noise)


def resolution(values: Array) -> float:
    """Return the step in which readings are rounded, or the least by which any two differ."""
    levels = np.unique(values[np.isfinite(values)])
    return float(np.min(np.diff(levels))) if len(levels) > 1 else 0.0


def _least(position: Array) -> float:
    """Return the least standard deviation that the noise of a position may have."""
    travel = float(np.nanmax(position) - np.nanmin(position))
    return max(resolution(position) / math.sqrt(12.0), FINEST * travel, 1e-12)


def _levels(readings: Array) -> tuple[float, float]:
    """Return the likeliest noise, at least one, and the snap's density in one sample over it."""
    none = np.zeros((0, ORDER)), np.zeros((0, ORDER, ORDER))
    best, found = np.inf, (1.0, 1.0)
    for snap in TRIED:
        logarithms, squares, count = forwards(readings, np.full(len(readings), snap), *none)
        variance = max(squares / max(count, 1), 1.0)
        loss = logarithms + count * np.log(variance) + squares / variance
        if loss < best:
            best, found = loss, (float(np.sqrt(variance)), float(snap))
    return found


class _Smoothed(NamedTuple):
    """States, and the levels of snap and noise that they make likeliest over those assumed."""

    states: Array
    snap: Array
    noise: float


def _smoothed(readings: Array, snap: Array) -> _Smoothed:
    """Return the states behind readings, all over the standard deviation of the noise."""
    count = len(readings)
    states, covariances = np.zeros((count, ORDER)), np.zeros((count, ORDER, ORDER))
    found = np.ones(count)
    forwards(readings, snap, states, covariances)
    noise = backwards(readings, snap, states, covariances, found)
    return _Smoothed(states, found, float(np.sqrt(noise)))
