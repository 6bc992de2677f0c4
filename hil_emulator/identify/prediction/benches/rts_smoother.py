"""The loop that smooths a position: a Kalman filter forwards, its adjoint backwards.

The state is position, velocity times the period, acceleration times its square and jerk times its
cube, all over the standard deviation of the noise. White snap drives it, the next derivative: a rod
that reverses within ten samples has an acceleration that white jerk would smear (Bar-Shalom et al.
2001, section 6.2, to one order more).
"""

from typing import Any

import numba
import numpy as np

compiled = numba.njit(cache=True, error_model="numpy", nogil=True)

ORDER = 4
"""Derivatives in the state, that of order zero included."""

DRIVEN = np.array([
    [1 / 252, 1 / 72, 1 / 30, 1 / 24],
    [1 / 72, 1 / 20, 1 / 8, 1 / 6],
    [1 / 30, 1 / 8, 1 / 3, 1 / 2],
    [1 / 24, 1 / 6, 1 / 2, 1.0],
])  # fmt: skip
"""Covariance that white snap of unit density adds in one sample."""

VAGUE = 1e8
"""Variance of the derivatives before anything was read."""


@compiled
def forwards(readings: Any, snap: Any, states: Any, covariances: Any) -> tuple[float, float, int]:
    """Filter readings; return the two sums of the likelihood, and how many readings counted.

    Args:
        readings: over the noise's standard deviation, NaN where missing.
        snap: density of the snap from each sample to the next.
        states: predicted from the past, shape (samples, 4) or none; overwritten.
        covariances: of these, shape (samples, 4, 4) or none; overwritten.

    Returns:
        The sum of the logarithms of the innovations' variances, that of the innovations' squares
        over them, and their number; the first four readings only tell where it began.

    """
    x, p, gain = np.zeros(ORDER), np.zeros((ORDER, ORDER)), np.zeros(ORDER)
    for i in range(ORDER):
        p[i, i] = VAGUE
    logarithms, squares, seen = 0.0, 0.0, 0
    for k in range(len(readings)):
        if k:
            proceed(x)
            carry(p)
            for i in range(ORDER):
                for j in range(ORDER):
                    p[i, j] += snap[k - 1] * DRIVEN[i, j]
        if np.isfinite(readings[k]) and not seen:
            x[0] = readings[k]
        if len(states):
            states[k] = x
            covariances[k] = p
        if np.isfinite(readings[k]):
            variance, error = p[0, 0] + 1.0, readings[k] - x[0]
            for i in range(ORDER):
                gain[i] = p[i, 0] / variance
                x[i] += gain[i] * error
            for i in range(ORDER):
                for j in range(ORDER):
                    p[i, j] -= variance * gain[i] * gain[j]
            seen += 1
            if seen > ORDER:
                logarithms += np.log(variance)
                squares += error * error / variance
    return logarithms, squares, max(seen - ORDER, 0)


@compiled
def backwards(readings: Any, snap: Any, states: Any, covariances: Any, found: Any) -> float:
    """Smooth what `forwards` predicted (Bryson and Frazier 1963).

    Args:
        readings: as there.
        snap: as there.
        states: as there; overwritten by the smoothed ones.
        covariances: as there.
        found: the density of the snap from each sample to the next by what was read before and
            after, expected value over that was assumed; overwritten.

    Returns:
        The variance of the noise in the same way.

    """
    slope, curvature, gain = np.zeros(ORDER), np.zeros((ORDER, ORDER)), np.zeros(ORDER)
    found[-1] = 1.0
    squares, seen = 0.0, 0
    for k in range(len(readings) - 1, -1, -1):
        x, p = states[k], covariances[k]
        if k < len(readings) - 1:
            pushed = 0.0
            for i in range(ORDER):
                for j in range(ORDER):
                    pushed += DRIVEN[i, j] * (slope[i] * slope[j] - curvature[i, j])
            found[k] = 1.0 + snap[k] * pushed / ORDER
            recede(slope)
            for i in range(ORDER):
                recede(curvature[:, i])
            for i in range(ORDER):
                recede(curvature[i])
        if np.isfinite(readings[k]):
            variance = p[0, 0] + 1.0
            for i in range(ORDER):
                gain[i] = p[i, 0] / variance
            pulled = multiply(curvature, gain)
            error = dot(gain, slope) + (readings[k] - x[0]) / variance
            certainty = dot(gain, pulled) + 1.0 / variance
            squares += error * error + 1.0 - certainty
            seen += 1
            slope[0] -= error
            curvature[0, 0] += certainty
            for i in range(ORDER):
                curvature[0, i] -= pulled[i]
                curvature[i, 0] -= pulled[i]
            even(curvature)
        x -= multiply(p, slope)
    return squares / max(seen, 1)


@compiled
def proceed(x: Any) -> None:
    """Move a state on by one sample."""
    x[0] += x[1] + 0.5 * x[2] + x[3] / 6.0
    x[1] += x[2] + 0.5 * x[3]
    x[2] += x[3]


@compiled
def recede(slope: Any) -> None:
    """Move a derivative by the state back by one sample."""
    slope[3] += slope[2] + 0.5 * slope[1] + slope[0] / 6.0
    slope[2] += slope[1] + 0.5 * slope[0]
    slope[1] += slope[0]


@compiled
def carry(p: Any) -> None:
    """Move a covariance on by one sample."""
    for i in range(ORDER):
        proceed(p[:, i])
    for i in range(ORDER):
        proceed(p[i])
    even(p)


@compiled
def even(p: Any) -> None:
    """Make a matrix symmetric: what rounding adds to the other part would grow."""
    for i in range(ORDER):
        for j in range(i):
            p[i, j] = p[j, i] = 0.5 * (p[i, j] + p[j, i])


@compiled
def multiply(a: Any, x: Any) -> Any:
    """Return the product of a matrix and a vector."""
    y = np.zeros(ORDER)
    for i in range(ORDER):
        y[i] = dot(a[i], x)
    return y


@compiled
def dot(x: Any, y: Any) -> Any:
    """Return the scalar product of two vectors."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3]
