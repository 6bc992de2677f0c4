"""Fundamental of a recorded signal."""

import numpy as np

from hil_emulator.characterise.result import Series


def fundamental(time: Series, values: Series, omega: float) -> complex:
    """Return the complex amplitude c of values = mean + trend + Im(c exp(j omega t)).

    By least squares, so the record need not be a whole number of periods; the linear trend models a
    drift of the mean.

    Args:
        time: [s], shape (n,).
        values: shape (n,).
        omega: angular frequency [rad/s].

    """
    phase = omega * time
    basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(time), time - time.mean()])
    sine, cosine = np.linalg.lstsq(basis, values, rcond=None)[0][:2]
    return complex(sine, cosine)


def crossing(x: Series, y: Series, level: float) -> float:
    """Return the first x (interpolated on a log scale) at which y falls below a level, or nan."""
    below = np.flatnonzero(y < level)
    if not below.size or below[0] == 0:
        return float("nan")
    i = below[0]
    share = (y[i - 1] - level) / (y[i - 1] - y[i])
    return float(x[i - 1] * (x[i] / x[i - 1]) ** share)
