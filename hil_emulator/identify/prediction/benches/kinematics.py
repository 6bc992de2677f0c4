"""Velocity and acceleration of a measured position, by a Kalman smoother with estimated noise.

The measurement noise and the density of the snap that drives the motion maximise the likelihood.
The snap is larger at reversals; its density is therefore re-estimated for every sample from the
smoothed states around it (expectation maximisation; Dempster, Laird and Rubin 1977).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.benches.rts_smoother import ORDER, backwards, forwards

TRIED = np.exp(np.arange(-60.0, 11.0, 2.0))
"""Snap densities over the noise, per sample: from one parabola through all samples to no
smoothing."""

AROUND = 5
"""Samples over which the snap density is averaged (assumed: fewer are too noisy, more blur the
start of a motion)."""

PASSES = 8
"""Iterations until the snap density has converged."""

FAINTEST = 1e-6
"""Smallest snap density over that of the whole recording (assumed); limits rounding errors of the
smoother at standstill."""

FINEST = 1e-6
"""Smallest noise over the travel (assumed); less than that of any position sensor."""


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
    """Return the smoothed motion for readings of a position.

    Args:
        position: readings [m], NaN where missing.
        period: of the samples [s].

    """
    centre = float(np.nanmean(position))
    least = _least(position)
    noise, snap = _levels((position - centre) / least)
    level = np.full(len(position), snap)
    for _ in range(PASSES):
        smoothed = _smoothed((position - centre) / (noise * least), level)
        around = uniform_filter1d(level * smoothed.snap, AROUND, mode="nearest")
        before, noise = noise, max(noise * smoothed.noise, 1.0)
        level = np.maximum(around, FAINTEST * snap) * (before / noise) ** 2
    noise *= least
    states = _smoothed((position - centre) / noise, level).states[:, :3]
    states *= noise / period ** np.arange(3)
    states[:, 0] += centre
    return Motion(states, noise)


def resolution(values: Array) -> float:
    """Return the resolution of readings: the smallest difference of two of them."""
    levels = np.unique(values[np.isfinite(values)])
    return float(np.min(np.diff(levels))) if len(levels) > 1 else 0.0


def _least(position: Array) -> float:
    """Return a lower limit of the standard deviation of a position's noise."""
    travel = float(np.nanmax(position) - np.nanmin(position))
    return max(resolution(position) / math.sqrt(12.0), FINEST * travel, 1e-12)


def _levels(readings: Array) -> tuple[float, float]:
    """Return the most likely noise, at least 1, and the snap density per sample over it."""
    nothing = np.zeros((0, ORDER)), np.zeros((0, ORDER, ORDER))
    best, levels = np.inf, (1.0, 1.0)
    for snap in TRIED:
        logarithms, squares, count = forwards(readings, np.full(len(readings), snap), *nothing)
        variance = max(squares / max(count, 1), 1.0)
        loss = logarithms + count * np.log(variance) + squares / variance
        if loss < best:
            best, levels = loss, (float(np.sqrt(variance)), float(snap))
    return levels


class _Smoothed(NamedTuple):
    """States, and the re-estimated levels of snap and noise over the assumed ones."""

    states: Array
    snap: Array
    noise: float


def _smoothed(readings: Array, snap: Array) -> _Smoothed:
    """Return the smoothed states of readings, both over the standard deviation of the noise."""
    count = len(readings)
    states, covariances = np.zeros((count, ORDER)), np.zeros((count, ORDER, ORDER))
    snap_ratio = np.ones(count)
    forwards(readings, snap, states, covariances)
    noise = backwards(readings, snap, states, covariances, snap_ratio)
    return _Smoothed(states, snap_ratio, float(np.sqrt(noise)))
