"""Huber's robust loss of innovations (Huber 1964)."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array

OUTLIER = 3.0
"""Whitened innovations beyond this have linear instead of quadratic loss: cavitation and impacts
cause a few large ones that would dominate the fit."""

WORST = 100.0
"""Bound of a whitened innovation, for a prediction that diverged."""


def tamed(innovations: Array) -> Array:
    """Return residuals whose squares are Huber's loss of innovations, flat."""
    bounded = np.clip(innovations.ravel(), -WORST, WORST)
    # roots only for the few large ones
    large = np.flatnonzero(~(np.abs(bounded) <= OUTLIER))
    size = np.nan_to_num(bounded[large], nan=WORST)
    rooted = np.sqrt(2.0 * OUTLIER * np.abs(size) - OUTLIER**2)
    bounded[large] = np.copysign(rooted, size)
    return np.asarray(bounded)
