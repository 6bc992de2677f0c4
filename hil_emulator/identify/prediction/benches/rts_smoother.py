"""Compiled smoother of a position: a forward Kalman filter and its adjoint backward pass.

The state is position, velocity times the period, acceleration times its square and jerk times its
cube, all over the standard deviation of the noise. It is driven by white snap: white jerk would
blur the acceleration of a rod that reverses within ten samples (Bar-Shalom et al. 2001, section
6.2, extended by one order).
"""

from pathlib import Path
from typing import Any

import numpy as np

from hil_emulator.model.compiling import allocating, entry_point

_compiled = allocating(nogil=True)
_entry_point = entry_point(Path(__file__), nogil=True, _nrt=True)

ORDER = 4
"""Number of states: the position and three derivatives."""

DRIVEN = np.array([
    [1 / 252, 1 / 72, 1 / 30, 1 / 24],
    [1 / 72, 1 / 20, 1 / 8, 1 / 6],
    [1 / 30, 1 / 8, 1 / 3, 1 / 2],
    [1 / 24, 1 / 6, 1 / 2, 1.0],
])  # fmt: skip
"""Process noise covariance of white snap of unit density, per sample."""

VAGUE = 1e8
"""Initial variance of all states."""


@_entry_point
def forwards(readings: Any, snap: Any, states: Any, covariances: Any) -> tuple[float, float, int]:
    """Run the filter over readings.

    Args:
        readings: over the noise's standard deviation, NaN where missing.
        snap: density of the snap from each sample to the next.
        states: receives the predicted states, shape (samples, 4) or (0, 4).
        covariances: receives their covariances, shape (samples, 4, 4) or (0, 4, 4).

    Returns:
        Sum of the logarithms of the innovations' variances, sum of the squared innovations over
        their variances, and number of innovations. The first four readings initialise the state
        and are not counted.

    """
    x, p, gain = np.zeros(ORDER), np.zeros((ORDER, ORDER)), np.zeros(ORDER)
    for i in range(ORDER):
        p[i, i] = VAGUE
    logarithms, squares, used = 0.0, 0.0, 0
    for k in range(len(readings)):
        if k:
            proceed(x)
            carry(p)
            for i in range(ORDER):
                for j in range(ORDER):
                    p[i, j] += snap[k - 1] * DRIVEN[i, j]
        if np.isfinite(readings[k]) and not used:
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
            used += 1
            if used > ORDER:
                logarithms += np.log(variance)
                squares += error * error / variance
    return logarithms, squares, max(used - ORDER, 0)


@_entry_point
def backwards(readings: Any, snap: Any, states: Any, covariances: Any, snap_ratio: Any) -> float:
    """Smooth the states of `forwards` (Bryson and Frazier 1963).

    Args:
        readings: as for `forwards`.
        snap: as for `forwards`.
        states: as from `forwards`; replaced by the smoothed states.
        covariances: as from `forwards`.
        snap_ratio: receives the expected snap density over the assumed one, from each sample to
            the next.

    Returns:
        The expected variance of the noise over the assumed one.

    """
    slope, curvature, gain = np.zeros(ORDER), np.zeros((ORDER, ORDER)), np.zeros(ORDER)
    snap_ratio[-1] = 1.0
    squares, used = 0.0, 0
    for k in range(len(readings) - 1, -1, -1):
        x, p = states[k], covariances[k]
        if k < len(readings) - 1:
            excess = 0.0
            for i in range(ORDER):
                for j in range(ORDER):
                    excess += DRIVEN[i, j] * (slope[i] * slope[j] - curvature[i, j])
            snap_ratio[k] = 1.0 + snap[k] * excess / ORDER
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
            used += 1
            slope[0] -= error
            curvature[0, 0] += certainty
            for i in range(ORDER):
                curvature[0, i] -= pulled[i]
                curvature[i, 0] -= pulled[i]
            even(curvature)
        x -= multiply(p, slope)
    return squares / max(used, 1)


@_compiled
def proceed(x: Any) -> None:
    """Advance a state by one sample, in place."""
    x[0] += x[1] + 0.5 * x[2] + x[3] / 6.0
    x[1] += x[2] + 0.5 * x[3]
    x[2] += x[3]


@_compiled
def recede(slope: Any) -> None:
    """Propagate a gradient with respect to the state back by one sample, in place."""
    slope[3] += slope[2] + 0.5 * slope[1] + slope[0] / 6.0
    slope[2] += slope[1] + 0.5 * slope[0]
    slope[1] += slope[0]


@_compiled
def carry(p: Any) -> None:
    """Propagate a covariance by one sample, in place, without process noise."""
    for i in range(ORDER):
        proceed(p[:, i])
    for i in range(ORDER):
        proceed(p[i])
    even(p)


@_compiled
def even(p: Any) -> None:
    """Make a matrix symmetric, since antisymmetric rounding errors would grow."""
    for i in range(ORDER):
        for j in range(i):
            p[i, j] = p[j, i] = 0.5 * (p[i, j] + p[j, i])


@_compiled
def multiply(a: Any, x: Any) -> Any:
    """Return the product of a matrix and a vector."""
    y = np.zeros(ORDER)
    for i in range(ORDER):
        y[i] = dot(a[i], x)
    return y


@_compiled
def dot(x: Any, y: Any) -> Any:
    """Return the scalar product of two vectors."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3]
