"""The loop that smooths a position: a Kalman filter forwards, its adjoint backwards.

The state is position, velocity times the period and acceleration times its square, all over the
standard deviation of the noise; white jerk drives it (Bar-Shalom et al. 2001, eq. 6.2.3-9).
"""

from typing import Any

import numba
import numpy as np

compiled = numba.njit(cache=True, error_model="numpy", nogil=True)

DRIVEN = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]])
"""Covariance that white jerk of unit density adds in one sample."""

VAGUE = 1e8
"""Variance of velocity and acceleration before anything was read."""


@compiled
def forwards(readings: Any, jerk: Any, states: Any, covariances: Any) -> tuple[float, float, int]:
    """Filter readings; return the two sums of the likelihood, and how many readings counted.

    Args:
        readings: over the noise's standard deviation, NaN where missing.
        jerk: density of the jerk from each sample to the next.
        states: predicted from the past, shape (samples, 3) or none; overwritten.
        covariances: of these, shape (samples, 3, 3) or none; overwritten.

    Returns:
        The sum of the logarithms of the innovations' variances, that of the innovations' squares
        over them, and their number; the first three readings only tell where it began.

    """
    x, p, gain = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    p[0, 0] = p[1, 1] = p[2, 2] = VAGUE
    logarithms, squares, seen = 0.0, 0.0, 0
    for k in range(len(readings)):
        if k:
            proceed(x)
            carry(p)
            for i in range(3):
                for j in range(3):
                    p[i, j] += jerk[k - 1] * DRIVEN[i, j]
        if np.isfinite(readings[k]) and not seen:
            x[0] = readings[k]
        if len(states):
            states[k] = x
            covariances[k] = p
        if np.isfinite(readings[k]):
            variance, error = p[0, 0] + 1.0, readings[k] - x[0]
            for i in range(3):
                gain[i] = p[i, 0] / variance
                x[i] += gain[i] * error
            for i in range(3):
                for j in range(3):
                    p[i, j] -= variance * gain[i] * gain[j]
            seen += 1
            if seen > 3:
                logarithms += np.log(variance)
                squares += error * error / variance
    return logarithms, squares, max(seen - 3, 0)


@compiled
def backwards(readings: Any, jerk: Any, states: Any, covariances: Any, found: Any) -> None:
    """Smooth what `forwards` predicted (Bryson and Frazier 1963).

    Args:
        readings: as there.
        jerk: as there.
        states: as there; overwritten by the smoothed ones.
        covariances: as there.
        found: the density of the jerk from each sample to the next by what was read before and
            after, expected value over that was assumed; overwritten.

    """
    slope, curvature, gain = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    found[-1] = 1.0
    for k in range(len(readings) - 1, -1, -1):
        x, p = states[k], covariances[k]
        if k < len(readings) - 1:
            pushed = 0.0
            for i in range(3):
                for j in range(3):
                    pushed += DRIVEN[i, j] * (slope[i] * slope[j] - curvature[i, j])
            found[k] = 1.0 + jerk[k] * pushed / 3.0
            recede(slope)
            for i in range(3):
                recede(curvature[:, i])
            for i in range(3):
                recede(curvature[i])
        if np.isfinite(readings[k]):
            variance = p[0, 0] + 1.0
            for i in range(3):
                gain[i] = p[i, 0] / variance
            pulled = multiply(curvature, gain)
            slope[0] -= dot(gain, slope) + (readings[k] - x[0]) / variance
            curvature[0, 0] += dot(gain, pulled) + 1.0 / variance
            for i in range(3):
                curvature[0, i] -= pulled[i]
                curvature[i, 0] -= pulled[i]
            even(curvature)
        x -= multiply(p, slope)


@compiled
def proceed(x: Any) -> None:
    """Move a state on by one sample."""
    x[0] += x[1] + 0.5 * x[2]
    x[1] += x[2]


@compiled
def recede(slope: Any) -> None:
    """Move a derivative by the state back by one sample."""
    slope[2] += slope[1] + 0.5 * slope[0]
    slope[1] += slope[0]


@compiled
def carry(p: Any) -> None:
    """Move a covariance on by one sample."""
    for i in range(3):
        proceed(p[:, i])
    for i in range(3):
        proceed(p[i])
    even(p)


@compiled
def even(p: Any) -> None:
    """Make a matrix symmetric: what rounding adds to the other part would grow."""
    for i in range(3):
        for j in range(i):
            p[i, j] = p[j, i] = 0.5 * (p[i, j] + p[j, i])


@compiled
def multiply(a: Any, x: Any) -> Any:
    """Return the product of a matrix and a vector."""
    y = np.zeros(3)
    for i in range(3):
        y[i] = dot(a[i], x)
    return y


@compiled
def dot(x: Any, y: Any) -> Any:
    """Return the scalar product of two vectors."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
