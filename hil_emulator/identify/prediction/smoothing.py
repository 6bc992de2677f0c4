"""The loop that finds what a balance lacked at every moment, as `filter` has the predictor's."""

from typing import Any

import numpy as np


def smooth(
    gains: Any, whitening: Any, maps: Any, senses: Any, drives: Any, feeds: Any, weights: Any,
    residual: Any, decay: float, variance: float, term: Any,
) -> None:  # fmt: skip
    """Estimate a coloured term in one balance from the innovations, before and after in time.

    The deviation of the machine from the predictor is a linear system that the term drives; a
    Kalman filter forwards and the adjoint backwards (Bryson and Frazier) need no inverse of a
    covariance.

    Args:
        gains: see `linearised.linearise`, as the next three.
        whitening: see there.
        maps: see there.
        senses: see there.
        drives: what the term adds to the next z, shape (samples, z).
        feeds: what it adds to the next reading, shape (samples, channels).
        weights: of the whitened innovations, shape (channels,).
        residual: weighted innovations, shape (samples, channels).
        decay: what remains of the term after a sample.
        variance: of the term.
        term: the estimate, shape (samples,); overwritten.

    """
    count, n, m = gains.shape
    size = n + 1
    x, cov = np.zeros(size), np.zeros((size, size))
    cov[n, n] = variance
    level, rows = np.zeros(count), np.zeros((count, size))
    kept, solved = np.zeros((count, size, m)), np.zeros((count, m))
    step, seen = np.zeros((size, size)), np.zeros((m, size))
    for k in range(count - 1):
        level[k] = x[n]
        rows[k] = cov[n]
        observe(whitening[k + 1], senses[k], feeds[k], weights, seen)
        inside = seen @ cov
        s = inside @ seen.T
        for i in range(m):
            s[i, i] += 1.0
        inverse = np.linalg.inv(s)
        gain = inside.T @ inverse
        error = residual[k + 1] - seen @ x
        kept[k] = gain
        solved[k] = inverse @ error
        x = x + gain @ error
        cov = cov - gain @ inside
        proceed(gains[k + 1], maps[k], senses[k], drives[k], feeds[k], decay, step)
        x = step @ x
        cov = step @ cov @ step.T
        cov = 0.5 * (cov + cov.T)
        cov[n, n] += variance * (1.0 - decay * decay)
    adjoint = np.zeros(size)
    term[count - 1] = 0.0
    for k in range(count - 2, -1, -1):
        observe(whitening[k + 1], senses[k], feeds[k], weights, seen)
        proceed(gains[k + 1], maps[k], senses[k], drives[k], feeds[k], decay, step)
        later = step.T @ adjoint
        adjoint = later - seen.T @ (kept[k].T @ later) - seen.T @ solved[k]
        term[k] = level[k] - np.sum(rows[k] * adjoint)


def observe(whitening: Any, senses: Any, feeds: Any, weights: Any, seen: Any) -> None:
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
    gains: Any, maps: Any, senses: Any, drives: Any, feeds: Any, decay: float, step: Any
) -> None:
    """Fill the map of deviation and term over one sample, the next correction included."""
    n, m = gains.shape
    for i in range(n):
        for j in range(n):
            step[i, j] = maps[i, j]
            for c in range(m):
                step[i, j] -= gains[i, c] * senses[c, j]
        step[i, n] = drives[i]
        for c in range(m):
            step[i, n] -= gains[i, c] * feeds[c]
        step[n, i] = 0.0
    step[n, n] = decay
