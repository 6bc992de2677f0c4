"""Damped Gauss-Newton steps, and a Jacobian that learns from them."""

import math
from collections.abc import Iterator

import numpy as np

from hil_emulator.identify.measured.experiment import Array

DAMPINGS = (1e-9, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Damping of a step over the diagonal of its normal equations, tried in turn until one helps: where
two parameters nearly make up for each other, it is their common way that a step overdoes."""

HEAVY_DAMPINGS = (10.0, 100.0)
"""The same for a first step that none of them mends; later on they would only creep along valleys
that lead out of what anyone believes."""


ROWS_AT_ONCE = 4096
"""Rows of a Jacobian that are corrected at once."""

LEAST_PROMISED = 1e-3
"""Gain in chi-square below which a step is not tried: it moves no estimate by more than 3 % of its
standard deviation."""

LEAST_MENDED = 0.1
"""The same once a step has failed: what damping mends is then a matter of rounding (assumed)."""

ALIKE = 0.05
"""Part of a step that failed within which a damped one changes the residual as it did, and would
fail as well (assumed)."""


def steps(
    jacobian: Array, residual: Array, weights: Array, at: Array, bounds: tuple[Array, Array],
    first: bool,
) -> Iterator[Array]:  # fmt: skip
    """Yield steps with prior rows, damped more and more (Levenberg 1944, Marquardt 1963).

    Each is tried when the one before has failed; they end where no step promises anything. A
    coordinate that would leave its bounds goes to them, and the others know.

    Args:
        jacobian: Jacobian of the residual, shape (residuals, coordinates).
        residual: where the steps begin.
        weights: one over the prior's standard deviation of each coordinate.
        at: the coordinates there.
        bounds: smallest and largest value of each.
        first: whether it is the first step with a fresh Jacobian.

    """
    normal = jacobian.T @ jacobian + np.diag(weights**2)
    gradient = jacobian.T @ residual + weights**2 * at
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled, slope = normal / np.outer(scale, scale), gradient / scale
    least, failed = LEAST_PROMISED, None
    low, high = ((end - at) * scale for end in bounds)
    for damping in (*DAMPINGS, *(HEAVY_DAMPINGS if first else ())):
        step = _within(scaled + damping * np.eye(len(at)), slope, low, high)
        if failed is not None and _length(scaled, step - failed) < ALIKE * _length(scaled, failed):
            continue
        if -step @ (2.0 * slope + scaled @ step) < least:
            return
        yield step / scale
        least, failed = LEAST_MENDED, step


def _within(normal: Array, slope: Array, low: Array, high: Array) -> Array:
    """Return the step to the minimum of a parabola, with what would go too far at its end."""
    step = -np.linalg.solve(normal, slope)
    held = np.zeros(len(slope), dtype=bool)
    while np.any(beyond := ~held & ((step < low) | (step > high))):
        held |= beyond
        step[beyond] = np.clip(step, low, high)[beyond]
        free = ~held
        pull = slope[free] + normal[np.ix_(free, held)] @ step[held]
        step[free] = -np.linalg.solve(normal[np.ix_(free, free)], pull)
    return np.asarray(step)


def _length(scaled: Array, step: Array) -> float:
    """Return how far a step moves the residual and the priors."""
    return math.sqrt(max(float(step @ scaled @ step), 0.0))


def learn(jacobian: Array, moved: Array, changed: Array) -> None:
    """Correct a Jacobian by what a step has shown (Broyden 1965)."""
    surprise = changed - jacobian @ moved
    parts = moved / max(float(moved @ moved), 1e-12)
    # some rows at a time: the outer product of a long recording is large
    for first in range(0, len(jacobian), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        jacobian[rows] += surprise[rows, None] * parts
