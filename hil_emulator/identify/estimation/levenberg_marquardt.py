"""Damped Gauss-Newton steps, and Broyden's update of the Jacobian."""

import math
from collections.abc import Iterator

import numpy as np

from hil_emulator.identify.measured.experiment import Array

DAMPINGS = (1e-9, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Damping over the diagonal of the normal equations, increased until a step succeeds. Undamped
steps are too long along directions in which two parameters nearly compensate each other."""

HEAVY_DAMPINGS = (10.0, 100.0)
"""Further values for a first step. Later steps with so much damping would only follow flat valleys
to implausible parameters."""


ROWS_AT_ONCE = 4096
"""Rows of a Jacobian that are updated at once; limits the memory."""

LEAST_PREDICTED = 1e-3
"""Predicted gain in chi-square below which a step is not tried: it would change no estimate by more
than 3 % of its standard deviation."""

LEAST_PREDICTED_DAMPED = 0.1
"""The same after a failed step (assumed)."""

SAME_STEP = 0.05
"""Relative difference from a failed step below which a damped step is skipped (assumed)."""


def steps(
    jacobian: Array, residual: Array, weights: Array, at: Array, bounds: tuple[Array, Array],
    first: bool,
) -> Iterator[Array]:  # fmt: skip
    """Yield steps with priors and increasing damping (Levenberg 1944, Marquardt 1963).

    The caller tries them in turn. The sequence ends when the predicted gain is too small. A
    coordinate that would exceed a bound is fixed there, and the step of the others is recomputed.

    Args:
        jacobian: Jacobian of the residual, shape (residuals, coordinates).
        residual: at the start of the step.
        weights: inverse prior standard deviation of each coordinate.
        at: coordinates at the start of the step.
        bounds: smallest and largest value of each.
        first: whether it is the first step with a fresh Jacobian.

    """
    normal = jacobian.T @ jacobian + np.diag(weights**2)
    gradient = jacobian.T @ residual + weights**2 * at
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled, slope = normal / np.outer(scale, scale), gradient / scale
    least, failed = LEAST_PREDICTED, None
    low, high = ((end - at) * scale for end in bounds)
    for damping in (*DAMPINGS, *(HEAVY_DAMPINGS if first else ())):
        step = _within(scaled + damping * np.eye(len(at)), slope, low, high)
        if failed is not None and (
            _length(scaled, step - failed) < SAME_STEP * _length(scaled, failed)
        ):
            continue
        if -step @ (2.0 * slope + scaled @ step) < least:
            return
        yield step / scale
        least, failed = LEAST_PREDICTED_DAMPED, step


def _within(normal: Array, slope: Array, low: Array, high: Array) -> Array:
    """Return the step to the minimum of a quadratic function within bounds (active set)."""
    step = -np.linalg.solve(normal, slope)
    fixed = np.zeros(len(slope), dtype=bool)
    while np.any(beyond := ~fixed & ((step < low) | (step > high))):
        fixed |= beyond
        step[beyond] = np.clip(step, low, high)[beyond]
        free = ~fixed
        gradient = slope[free] + normal[np.ix_(free, fixed)] @ step[fixed]
        step[free] = -np.linalg.solve(normal[np.ix_(free, free)], gradient)
    return np.asarray(step)


def _length(scaled: Array, step: Array) -> float:
    """Return the norm of the change of the residual and the priors by a step."""
    return math.sqrt(max(float(step @ scaled @ step), 0.0))


def update(jacobian: Array, step: Array, change: Array) -> None:
    """Update a Jacobian in place with the change of the residual by a step (Broyden 1965)."""
    error = change - jacobian @ step
    parts = step / max(float(step @ step), 1e-12)
    # block by block: the outer product of a long recording is large
    for first in range(0, len(jacobian), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        jacobian[rows] += error[rows, None] * parts
