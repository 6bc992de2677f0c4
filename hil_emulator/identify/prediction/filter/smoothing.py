"""The smoother: what a balance lacked at every sample, as `innovations` predicts each sample."""

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
    """How far the machine is from the predictor: a linear system that a term drives.

    Attributes:
        gains: the frozen gains.
        jacobians: along the predictor's trajectory.
        entries: where the term enters.
        weights: of the whitened innovations, shape (channels,).
        decay: what remains of the term after a sample.

    """

    gains: Gains
    jacobians: Jacobians
    entries: Entries
    weights: Array
    decay: float


class Forwards(NamedTuple):
    """What the way forwards leaves for the way back, of every sample.

    Attributes:
        level: the term as known from earlier ones, shape (samples,).
        rows: its covariance with deviation and term, shape (samples, z + 1).
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
    """Estimate a coloured term in one balance from the innovations, before and after in time.

    A Kalman filter forwards and the adjoint backwards (Bryson and Frazier) need no inverse of the
    term's covariance.

    Args:
        gains: the frozen gains.
        jacobians: along the predictor's trajectory.
        entries: where the term enters.
        weights: of the whitened innovations, shape (channels,).
        residual: weighted innovations, shape (samples, channels).
        decay: what remains of the term after a sample.
        variance: of the term.
        term: the estimate, shape (samples,); overwritten.

    """
    count, n, m = gains.kalman.shape
    driven = Driven(gains, jacobians, entries, weights, decay)
    passed = Forwards(
        np.zeros(count), np.zeros((count, n + 1)), np.zeros((count, n + 1, m)),
        np.zeros((count, m, 1)),
    )  # fmt: skip
    forwards(driven, residual, variance, passed)
    backwards(driven, passed, term)


def forwards(driven: Driven, residual: Array, variance: float, passed: Forwards) -> None:
    """Filter the innovations; fill in what the way back needs."""
    count, size, m = passed.kept.shape
    x, moved, cov, spread = (
        np.zeros((size, 1)), np.zeros((size, 1)), np.zeros((size, size)), np.zeros((size, size)),
    )  # fmt: skip
    step, work, seen = np.zeros((size, size)), np.zeros((size, size)), np.zeros((m, size))
    inside, half, error, whitened = (
        np.zeros((m, size)), np.zeros((m, size)), np.zeros((m, 1)), np.zeros((m, 1)),
    )  # fmt: skip
    s, root = np.zeros((m, m)), np.zeros((m, m))
    cov[size - 1, size - 1] = variance
    for k in range(count - 1):
        passed.level[k] = x[size - 1, 0]
        copy(cov[size - 1], passed.rows[k])
        observe(driven, k, seen)
        # the innovations' covariance, S^-1 = L L^T
        multiply(seen, cov, inside)
        multiply(inside, seen.T, s)
        for i in range(m):
            s[i, i] += 1.0
        root_of_inverse(s, root)
        multiply(root.T, inside, half)
        multiply(half.T, root.T, passed.kept[k])
        # the correction
        multiply(seen, x, error)
        for i in range(m):
            error[i, 0] = residual[k + 1, i] - error[i, 0]
        multiply(root.T, error, whitened)
        multiply(root, whitened, passed.solved[k])
        multiply(half.T, whitened, moved)
        multiply(half.T, half, spread)
        for i in range(size):
            x[i, 0] += moved[i, 0]
            for j in range(size):
                cov[i, j] -= spread[i, j]
        # one sample on
        proceed(driven, k, step)
        multiply(step, x, moved)
        congruence(step, cov, work, spread)
        copy(moved.ravel(), x.ravel())
        copy(spread.ravel(), cov.ravel())
        cov[size - 1, size - 1] += variance * (1.0 - driven.decay**2)


def backwards(driven: Driven, passed: Forwards, term: Array) -> None:
    """Add to the term what later innovations tell of it."""
    count, size, m = passed.kept.shape
    adjoint, later, change = np.zeros((size, 1)), np.zeros((size, 1)), np.zeros((size, 1))
    step, seen, told = np.zeros((size, size)), np.zeros((m, size)), np.zeros((m, 1))
    term[count - 1] = 0.0
    for k in range(count - 2, -1, -1):
        observe(driven, k, seen)
        proceed(driven, k, step)
        multiply(step.T, adjoint, later)
        multiply(passed.kept[k].T, later, told)
        for i in range(m):
            told[i, 0] += passed.solved[k, i, 0]
        multiply(seen.T, told, change)
        term[k] = passed.level[k]
        for i in range(size):
            adjoint[i, 0] = later[i, 0] - change[i, 0]
            term[k] -= passed.rows[k, i] * adjoint[i, 0]


def observe(driven: Driven, k: int, seen: Array) -> None:
    """Fill the derivative of the next weighted innovations by deviation and term."""
    whitening, senses = driven.gains.whitening[k + 1], driven.jacobians.senses[k]
    feeds, m, n = driven.entries.feeds[k], seen.shape[0], seen.shape[1] - 1
    for i in range(m):
        for j in range(n + 1):
            seen[i, j] = 0.0
        for c in range(m):
            for j in range(n):
                seen[i, j] += whitening[c, i] * senses[c, j]
            seen[i, n] += whitening[c, i] * feeds[c]
        for j in range(n + 1):
            seen[i, j] *= driven.weights[i]


def proceed(driven: Driven, k: int, step: Array) -> None:
    """Fill the map of deviation and term over one sample, the next correction included."""
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
