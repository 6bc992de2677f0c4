"""Smoother that estimates the missing term of a balance at every sample from the innovations."""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.model_run.records import Entries, Gains, Jacobians
from hil_emulator.identify.prediction.model_run.small_matrices import (
    congruence,
    copy,
    multiply,
    root_of_inverse,
)


class Driven(NamedTuple):
    """Linear system of the predictor's error, driven by a term.

    Attributes:
        gains: frozen gains.
        jacobians: along the predictor's trajectory.
        entries: derivatives of z and readings by the term.
        weights: of the whitened innovations, shape (channels,).
        decay: autocorrelation of the term over one sample.

    """

    gains: Gains
    jacobians: Jacobians
    entries: Entries
    weights: Array
    decay: float


class ForwardPass(NamedTuple):
    """Results of the forward pass stored for the backward pass.

    Attributes:
        level: predicted term, shape (samples,).
        rows: its covariance with error and term, shape (samples, z + 1).
        kept: gain of the correction, shape (samples, z + 1, channels).
        solved: innovation over its covariance, shape (samples, channels, 1).

    """

    level: Array
    rows: Array
    kept: Array
    solved: Array


def smooth(
    gains: Gains, jacobians: Jacobians, entries: Entries, weights: Array, residual: Array,
    decay: float, variance: float, term: Array,
) -> None:  # fmt: skip
    """Estimate a coloured term in one balance from all innovations.

    Modified Bryson-Frazier smoother, which does not invert the state's covariance.

    Args:
        gains: frozen gains.
        jacobians: along the predictor's trajectory.
        entries: derivatives of z and readings by the term.
        weights: of the whitened innovations, shape (channels,).
        residual: weighted innovations, shape (samples, channels).
        decay: autocorrelation of the term over one sample.
        variance: of the term.
        term: receives the estimate, shape (samples,).

    """
    count, n, m = gains.kalman.shape
    driven = Driven(gains, jacobians, entries, weights, decay)
    stored = ForwardPass(
        np.zeros(count), np.zeros((count, n + 1)), np.zeros((count, n + 1, m)),
        np.zeros((count, m, 1)),
    )  # fmt: skip
    forward_pass(driven, residual, variance, stored)
    backward_pass(driven, stored, term)


def forward_pass(driven: Driven, residual: Array, variance: float, stored: ForwardPass) -> None:
    """Filter the innovations, and store results for the backward pass."""
    count, size, m = stored.kept.shape
    x, moved, cov, spread = (
        np.zeros((size, 1)), np.zeros((size, 1)), np.zeros((size, size)), np.zeros((size, size)),
    )  # fmt: skip
    step, work, slope = np.zeros((size, size)), np.zeros((size, size)), np.zeros((m, size))
    inside, half, error, whitened = (
        np.zeros((m, size)), np.zeros((m, size)), np.zeros((m, 1)), np.zeros((m, 1)),
    )  # fmt: skip
    s, root = np.zeros((m, m)), np.zeros((m, m))
    cov[size - 1, size - 1] = variance
    for k in range(count - 1):
        stored.level[k] = x[size - 1, 0]
        copy(cov[size - 1], stored.rows[k])
        observe(driven, k, slope)
        # covariance of the innovations, S^-1 = L L^T
        multiply(slope, cov, inside)
        multiply(inside, slope.T, s)
        for i in range(m):
            s[i, i] += 1.0
        root_of_inverse(s, root)
        multiply(root.T, inside, half)
        multiply(half.T, root.T, stored.kept[k])
        # the correction
        multiply(slope, x, error)
        for i in range(m):
            error[i, 0] = residual[k + 1, i] - error[i, 0]
        multiply(root.T, error, whitened)
        multiply(root, whitened, stored.solved[k])
        multiply(half.T, whitened, moved)
        multiply(half.T, half, spread)
        for i in range(size):
            x[i, 0] += moved[i, 0]
            for j in range(size):
                cov[i, j] -= spread[i, j]
        # prediction of the next sample
        proceed(driven, k, step)
        multiply(step, x, moved)
        congruence(step, cov, work, spread)
        copy(moved.ravel(), x.ravel())
        copy(spread.ravel(), cov.ravel())
        cov[size - 1, size - 1] += variance * (1.0 - driven.decay**2)


def backward_pass(driven: Driven, stored: ForwardPass, term: Array) -> None:
    """Correct the term by the later innovations."""
    count, size, m = stored.kept.shape
    adjoint, later, change = np.zeros((size, 1)), np.zeros((size, 1)), np.zeros((size, 1))
    step, slope, combined = np.zeros((size, size)), np.zeros((m, size)), np.zeros((m, 1))
    term[count - 1] = 0.0
    for k in range(count - 2, -1, -1):
        observe(driven, k, slope)
        proceed(driven, k, step)
        multiply(step.T, adjoint, later)
        multiply(stored.kept[k].T, later, combined)
        for i in range(m):
            combined[i, 0] += stored.solved[k, i, 0]
        multiply(slope.T, combined, change)
        term[k] = stored.level[k]
        for i in range(size):
            adjoint[i, 0] = later[i, 0] - change[i, 0]
            term[k] -= stored.rows[k, i] * adjoint[i, 0]


def observe(driven: Driven, k: int, slope: Array) -> None:
    """Compute the derivative of the next weighted innovations by error and term."""
    whitening, senses = driven.gains.whitening[k + 1], driven.jacobians.senses[k]
    feeds, m, n = driven.entries.feeds[k], slope.shape[0], slope.shape[1] - 1
    for i in range(m):
        for j in range(n + 1):
            slope[i, j] = 0.0
        for c in range(m):
            for j in range(n):
                slope[i, j] += whitening[c, i] * senses[c, j]
            slope[i, n] += whitening[c, i] * feeds[c]
        for j in range(n + 1):
            slope[i, j] *= driven.weights[i]


def proceed(driven: Driven, k: int, step: Array) -> None:
    """Compute the map of error and term over one sample, with the next correction."""
    kalman, maps, senses = (
        driven.gains.kalman[k + 1],
        driven.jacobians.maps[k],
        driven.jacobians.senses[k],
    )
    drives, feeds = driven.entries.drives[k], driven.entries.feeds[k]
    n, m = kalman.shape
    for i in range(n):
        for j in range(n):
            step[i, j] = maps[i, j]
            for c in range(m):
                step[i, j] -= kalman[i, c] * senses[c, j]
        step[i, n] = drives[i]
        for c in range(m):
            step[i, n] -= kalman[i, c] * feeds[c]
        step[n, i] = 0.0
    step[n, n] = driven.decay
