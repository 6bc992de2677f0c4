"""Lag between signals, estimated by a partial multiple correlation.

The lag is the shift at which the shifted signals explain most of the leader, with signals that act
without a lag projected out. A stretch in which another shift explains nearly as much, such as a
single tone, gives no lag.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from hil_emulator.identify.measured.experiment import Array

LAG_WINDOW = 0.5
"""Length of a stretch in which one lag is measured [s] (assumed)."""

FARTHEST = 0.2
"""Lag up to which signals are compared [s] (assumed)."""

EXPLAINED_SHARE = 0.36
"""Part of the variance explained from which the lag of a stretch counts."""

LAG_BAND = 6e-3
"""Distance from the best lag at which other lags must explain less [s] (assumed)."""

PEAK_SHARPNESS = 1.05
"""Ratio of the unexplained parts there and at the best lag (assumed)."""

AT_ONCE = 32
"""Stretches per batch, to limit memory."""

_RIDGE = 1e-6  # of the shifted signals' Gram matrix, whose diagonal is 1 at most


def lags_of(
    leader: Array, followers: Sequence[Array], instant: Sequence[Array], period: float
) -> tuple[Array, Array]:
    """Return times and lags [s] of the stretches with a unique lag.

    Args:
        leader: the explained signal.
        followers: regressors that share one lag behind the leader; the first has a positive sign.
        instant: regressors without a lag.
        period: sample period [s].

    """
    length = round(LAG_WINDOW / period)
    reach = min(round(FARTHEST / period), length // 2)
    everything = np.column_stack([leader, *followers, *instant])
    starts = np.arange(0, len(leader) - length + 1, max(1, length // 2))
    parts = np.cumsum([1, len(followers)])
    times, lags = [], []
    for some in np.split(starts, range(AT_ONCE, len(starts), AT_ONCE)):
        stretches = everything[some[:, None] + np.arange(length)]
        whole = np.isfinite(stretches).all(axis=(1, 2))
        stretches = stretches[whole] - stretches[whole].mean(axis=1, keepdims=True)
        one, others, same = np.split(stretches, parts, axis=2)
        each = _explained(one, _orthonormal(others), _orthonormal(same), reach)
        for start, explained in zip(some[whole], each, strict=True):
            lag, most = peak(explained)
            if (
                most > EXPLAINED_SHARE
                and abs(lag) < reach
                and _sharp(explained, max(1, round(LAG_BAND / period)))
            ):
                times.append((start + 0.5 * length) * period)
                lags.append(lag * period)
    return np.array(times), np.array(lags)


def _orthonormal(columns: Array) -> Array:
    """Return orthonormal bases of columns, the first one along the first column."""
    sizes = np.maximum(np.sqrt(np.sum(columns**2, axis=1, keepdims=True)), 1e-30)
    basis, upper = np.linalg.qr(columns / sizes)
    signs = np.where(np.diagonal(upper, axis1=1, axis2=2) < 0.0, -1.0, 1.0)
    return np.asarray(basis * signs[:, None])


def _explained(leader: Array, moving: Array, instant: Array, reach: int) -> Array:
    """Return the part of the leader's variance explained at each lag of -reach ... reach samples.

    A partial multiple correlation: regressors without a lag are projected out of both sides.

    Args:
        leader: of each stretch, shape (stretches, samples, 1).
        moving: regressors with a lag, shape (stretches, samples, columns), orthonormal.
        instant: regressors without a lag, the same shape.
        reach: longest lag in samples.

    Returns:
        Shape (stretches, lags).

    """
    rest = leader - instant @ (instant.swapaxes(1, 2) @ leader)
    products = cross(np.concatenate([rest, instant], axis=2), moving, reach)
    along, shared = products[:, :, 0], products[:, :, 1:]
    gram = np.eye(moving.shape[2]) * (1.0 + _RIDGE) - shared.swapaxes(2, 3) @ shared
    sizes = np.linalg.solve(gram, along[..., None])[..., 0]
    part = np.sum(along * sizes, axis=2) / np.maximum(np.sum(rest**2, axis=1), 1e-30)
    return np.asarray(np.where(sizes[:, :, 0] > 0.0, part, 0.0))


def cross(leaders: Array, others: Array, reach: int) -> Array:
    """Return the products of each leader with each of the others at every lag.

    Args:
        leaders: shape (stretches, samples, leaders).
        others: shape (stretches, samples, others).
        reach: of the lags, -reach ... reach samples.

    Returns:
        Shape (stretches, lags, leaders, others).

    """
    size = next_fast_len(leaders.shape[1] + reach, real=True)
    ahead, behind = (rfft(x.swapaxes(1, 2), size) for x in (leaders, others))
    products = irfft(np.conj(ahead)[:, :, None] * behind[:, None], size)
    return np.asarray(np.moveaxis(products[..., np.arange(-reach, reach + 1)], 3, 1))


def peak(values: Array) -> tuple[float, float]:
    """Return the lag in samples at which values around lag zero are largest, and the largest."""
    reach, at = len(values) // 2, int(np.argmax(values))
    if not 0 < at < len(values) - 1:
        return float(at - reach), float(values[at])
    left, top, right = values[at - 1 : at + 2]
    bend = left - 2.0 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return at - reach + shift, float(top)


def _sharp(explained: Array, band: int) -> bool:
    """Return whether all lags outside a band around the best one explain clearly less."""
    best = int(np.argmax(explained))
    elsewhere = explained[np.abs(np.arange(len(explained)) - best) >= band]
    return bool(1.0 - elsewhere.max(initial=0.0) > PEAK_SHARPNESS * (1.0 - explained[best]))
