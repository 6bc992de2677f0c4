"""Coarse search for the starting point of the first fit, over parameters with wide priors.

A fit that starts with an edge five times too narrow, or a seal ten times too stiff, ends in another
local minimum.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

WIDE = math.log(2.0)
"""Prior standard deviation of a logarithm above which a parameter is searched: a factor of 2."""

LEVELS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
"""Values of the search, in prior standard deviations."""

NEARLY_ZERO = 0.8
"""Fraction of the distance to zero of the lowest value: at zero itself the derivative is zero, and
a fit would not leave it (assumed)."""

SWEEPS = 2
"""Passes over all parameters: the second one corrects those that compensated for another one."""


def coarse_start(fitter: Fitter, free: Sequence[Coordinate]) -> Array:
    """Minimise the deviance over a few values of each parameter with a wide prior, one by one.

    Args:
        fitter: with the training data; its filter gains are recomputed.
        free: all coordinates of the fit.

    Returns:
        Coordinates; zero for stated parameters and narrow priors.

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
