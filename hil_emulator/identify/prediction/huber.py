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
    flat = innovations.ravel()
    bounded = np.clip(np.nan_to_num(flat, nan=WORST, posinf=WORST, neginf=-WORST), -WORST, WORST)
    size = np.abs(bounded)
    rooted = np.sqrt(np.maximum(2.0 * OUTLIER * size - OUTLIER**2, 0.0))
    return np.asarray(np.where(size > OUTLIER, np.sign(bounded) * rooted, bounded))
