"""How much later one signal shows what another does, beside what else acts at the same time.

A lag is told from the phase that damping turns: of all shifts, the one at which the shifted signals
and those that act beside them explain most. Where another shift explains nearly as much, as with a
single tone, a stretch tells no lag.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hil_emulator.identify.measured.experiment import Array

LAG_WINDOW = 0.5
"""Length of a stretch in which one lag is measured [s] (assumed)."""

FARTHEST = 0.2
"""Lag up to which signals are compared [s] (assumed)."""

EXPLAINED_SHARE = 0.36
"""Part of the variance explained from which the lag of a stretch counts."""

LAG_BAND = 6e-3
"""Distance from the best lag at which others have to explain less [s] (assumed)."""

PEAK_SHARPNESS = 1.05
"""How many times as much remains unexplained there (assumed)."""

_RIDGE = 1e-6  # of the shifted signals' Gram matrix, whose diagonal is 1 at most

_Complex = np.ndarray[Any, np.dtype[np.complex128]]


def lags_of(
    leader: Array, followers: Sequence[Array], beside: Sequence[Array], period: float
) -> tuple[Array, Array]:
    """Return times and lags [s] of the stretches that tell one.

    Args:
        leader: what is explained.
        followers: what explains it, all of them with one lag behind it; the first one positively.
        beside: what explains it without a lag.
        period: sample period [s].

    """
    length = round(LAG_WINDOW / period)
    reach = min(round(FARTHEST / period), length // 2)
    everything = np.column_stack([leader, *followers, *beside])
    parts = np.cumsum([1, len(followers)])
    times, lags = [], []
    for start in range(0, len(leader) - length + 1, max(1, length // 2)):
        stretch = everything[start : start + length]
        if not np.isfinite(stretch).all():
            continue
        one, others, same = np.split(stretch - stretch.mean(axis=0), parts, axis=1)
        explained = _explained(one[:, 0], _orthonormal(others), _orthonormal(same), reach)
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
    """Return an orthonormal basis of columns, the first one in its own direction."""
    sizes = np.maximum(np.sqrt(np.sum(columns**2, axis=0)), 1e-30)
    basis, upper = np.linalg.qr(columns / sizes)
    return np.asarray(basis * np.where(np.diag(upper) < 0.0, -1.0, 1.0))


def _explained(leader: Array, moving: Array, beside: Array, reach: int) -> Array:
    """Return the part of the leader's variance explained at each lag of -reach ... reach samples.

    A partial multiple correlation: what acts beside is projected out of both sides.
    """
    rest = leader - beside @ (beside.T @ leader)
    along = cross(rest, moving, reach)
    gram = np.broadcast_to(np.eye(moving.shape[1]), (len(along), *(2 * moving.shape[1:]))).copy()
    for column in beside.T:
        shared = cross(column, moving, reach)
        gram -= shared[:, :, None] * shared[:, None, :]
    gram += _RIDGE * np.eye(moving.shape[1])
    sizes = np.linalg.solve(gram, along[:, :, None])[:, :, 0]
    part = np.sum(along * sizes, axis=1) / max(float(np.sum(rest**2)), 1e-30)
    return np.asarray(np.where(sizes[:, 0] > 0.0, part, 0.0))


def cross(a: Array, columns: Array, reach: int) -> Array:
    """Return the products of `a` with later columns, by lags of -reach ... reach samples."""
    size = 2 ** int(np.ceil(np.log2(2 * len(a))))
    spectrum: _Complex = np.conj(np.fft.rfft(a, size))[:, None]
    product = np.fft.irfft(np.fft.rfft(columns, size, axis=0) * spectrum, size, axis=0)
    return np.concatenate([product[-reach:], product[: reach + 1]])


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
    """Tell whether no lag outside a band around the best one explains nearly as much."""
    best = int(np.argmax(explained))
    elsewhere = explained[np.abs(np.arange(len(explained)) - best) >= band]
    return bool(1.0 - elsewhere.max(initial=0.0) > PEAK_SHARPNESS * (1.0 - explained[best]))
