"""The loop that finds what a balance lacked at every moment, as `filter` has the predictor's."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.records import Entries, Gains, Jacobians
from hil_emulator.identify.prediction.small_matrices import copy


def smooth(
    gains: Gains, jacobians: Jacobians, entries: Entries, weights: Array, residual: Array,
    decay: float, variance: float, term: Array,
) -> None:  # fmt: skip
    """Estimate a coloured term in one balance from the innovations, before and after in time.

    The deviation of the machine from the predictor is a linear system that the term drives; a
    Kalman filter forwards and the adjoint backwards (Bryson and Frazier) need no inverse of a
    covariance.

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
    kalman, whitening, maps, senses = (
        gains.kalman,
        gains.whitening,
        jacobians.maps,
        jacobians.senses,
    )
    drives, feeds = entries.drives, entries.feeds
    count, n, m = kalman.shape
    size = n + 1
    x, cov = np.zeros(size), np.zeros((size, size))
    cov[n, n] = variance
    level, rows = np.zeros(count), np.zeros((count, size))
    kept, solved = np.zeros((count, size, m)), np.zeros((count, m))
    step, seen = np.zeros((size, size)), np.zeros((m, size))
    for k in range(count - 1):
        level[k] = x[n]
        copy(cov[n], rows[k])
        observe(whitening[k + 1], senses[k], feeds[k], weights, seen)
        inside = seen @ cov
        s = inside @ seen.T
        for i in range(m):
            s[i, i] += 1.0
        inverse = np.linalg.inv(s)
        gain = inside.T @ inverse
        error = residual[k + 1] - seen @ x
        copy(gain.ravel(), kept[k].ravel())
        copy(inverse @ error, solved[k])
        x = x + gain @ error
        cov = cov - gain @ inside
        proceed(kalman[k + 1], maps[k], senses[k], drives[k], feeds[k], decay, step)
        x = step @ x
        cov = step @ cov @ step.T
        cov = 0.5 * (cov + cov.T)
        cov[n, n] += variance * (1.0 - decay * decay)
    adjoint = np.zeros(size)
    term[count - 1] = 0.0
    for k in range(count - 2, -1, -1):
        observe(whitening[k + 1], senses[k], feeds[k], weights, seen)
        proceed(kalman[k + 1], maps[k], senses[k], drives[k], feeds[k], decay, step)
        later = step.T @ adjoint
        adjoint = later - seen.T @ (kept[k].T @ later) - seen.T @ solved[k]
        term[k] = level[k] - np.sum(rows[k] * adjoint)


def observe(whitening: Array, senses: Array, feeds: Array, weights: Array, seen: Array) -> None:
    """Fill the derivative of the next weighted innovations by deviation and term."""
    m, n = senses.shape
    for i in range(m):
        for j in range(n + 1):
            seen[i, j] = 0.0
        for c in range(m):
            for j in range(n):
                seen[i, j] += whitening[c, i] * senses[c, j]
            seen[i, n] += whitening[c, i] * feeds[c]
        for j in range(n + 1):
            seen[i, j] *= weights[i]


def proceed(
    kalman: Array,
    maps: Array,
    senses: Array,
    drives: Array,
    feeds: Array,
    decay: float,
    step: Array,
) -> None:
    """Fill the map of deviation and term over one sample, the next correction included."""
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
    step[n, n] = decay
