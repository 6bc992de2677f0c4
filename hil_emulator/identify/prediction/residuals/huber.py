"""Residuals that a few large ones cannot rule (Huber 1964)."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array

OUTLIER = 3.0
"""Whitened innovations beyond this count linearly, not squared: cavitation and knocks make a few
large ones that would otherwise decide alone."""

WORST = 100.0
"""Whitened innovation of a prediction that ran away."""


def tamed(innovations: Array) -> Array:
    """Return residuals whose squares are Huber's loss of innovations, flat."""
    bounded = np.clip(innovations.ravel(), -WORST, WORST)
    # few are large: the others need no root
    large = np.flatnonzero(~(np.abs(bounded) <= OUTLIER))
    size = np.nan_to_num(bounded[large], nan=WORST)
    rooted = np.sqrt(2.0 * OUTLIER * np.abs(size) - OUTLIER**2)
    bounded[large] = np.copysign(rooted, size)
    return np.asarray(bounded)
