"""Where a first fit begins: by unstated numbers of which a machine may have far more or far less.

A fit that begins with an edge five times as narrow, or a seal ten times as stiff, as those of the
machine ends in another minimum.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

WIDE = math.log(2.0)
"""Logarithm of the factor that one standard deviation is, from which a number is tried."""

LEVELS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
"""Standard deviations at which it is tried."""

NEARLY_ZERO = 0.8
"""Part of the way to zero at which a number is tried: at zero itself its influence has no
derivative, and a fit would not leave it (assumed)."""

SWEEPS = 2
"""Times that all numbers are tried: one that makes up for another goes back the second time."""


def coarse_start(fitter: Fitter, free: Sequence[Coordinate]) -> Array:
    """Return where the deviance is least, of a few values of each wide number in turn.

    Args:
        fitter: with the training data; its gains are frozen anew.
        free: everything that is fitted.

    Returns:
        coordinates; zero where a number is stated or narrow.

    """
    best = np.zeros(len(free))
    wide = [i for i, c in enumerate(free) if _wide(c)]
    if not wide:
        return best
    least = _deviance(fitter, free, best)
    for i in wide * SWEEPS:
        for tried in list(_levels(free[i], best, i)):
            deviance = _deviance(fitter, free, tried)
            if deviance < least - LEAST_GAIN:
                least, best = deviance, tried
    return best


def _wide(c: Coordinate) -> bool:
    logarithmic = c.scaling in ("logarithmic", "vanishing")
    return not c.stated and logarithmic and c.prior * c.scale > WIDE


def _levels(c: Coordinate, at: Array, i: int) -> Iterator[Array]:
    """Yield a point with one coordinate at each level that is within its bounds."""
    low, high = c.bounds
    if c.scaling == "vanishing":
        low *= NEARLY_ZERO
    sizes = {float(np.clip(level * c.prior, low, high)) for level in LEVELS}
    for size in sorted(sizes - {float(at[i])}):
        yield np.where(np.arange(len(at)) == i, size, at)


def _deviance(fitter: Fitter, free: Sequence[Coordinate], at: Array) -> float:
    fitter.freeze(free, at)
    return fitter.deviance(free, at)
