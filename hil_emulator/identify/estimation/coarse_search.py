"""Coarse search for the starting point of the first fit, over parameters with wide priors.

A fit that starts with an edge five times too narrow, or a seal ten times too stiff, ends in another
local minimum.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import is_usual

WIDE = math.log(2.0)
"""Prior standard deviation of a logarithm above which a parameter is searched: a factor of 2."""

LEVELS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0)
"""Values of the search, in prior standard deviations."""

WITHOUT = 5.0
"""Upper bound, in prior standard deviations, from which it stands for a law without that part: a
presliding distance of 10 m leaves friction by velocity alone."""

NEARLY_ZERO = 0.8
"""Fraction of the distance to zero of the lowest value: at zero itself the derivative is zero, and
a fit would not leave it (assumed)."""

ENOUGH = 10_000
"""Samples of the search. What differs by a factor of two shows in less than a second of motion."""


def coarse_start(fitter: Fitter, free: Sequence[Coordinate]) -> Array:
    """Return the start of the first fit, near the global minimum of the deviance.

    Parameters with wide priors are searched twice: at the configured values of the others, and at
    those of a short fit. Usual effects remain zero. Of long data, the stretch with the strongest
    motion is used.

    Args:
        fitter: with the training data.
        free: all coordinates of the fit.

    Returns:
        Coordinates; zero if no prior is wide.

    """
    at = np.zeros(len(free))
    wide = [i for i, c in enumerate(free) if _wide(c)]
    if not wide:
        return at
    most = ENOUGH // len(fitter.experiments)
    fitter = fitter.on([_liveliest(e, most) for e in fitter.experiments])
    _, at = _swept(fitter, free, at, wide)
    ordinary = [i for i, c in enumerate(free) if not is_usual(c)]
    at[ordinary] = converge(fitter, [free[i] for i in ordinary], at[ordinary], passes=1).at
    starts = [_swept(fitter, free, at, wide)]
    for i in (k for k in wide if free[k].bounds[1] > WITHOUT * free[k].prior):
        without = np.where(np.arange(len(at)) == i, free[i].bounds[1], at)
        starts.append(_swept(fitter, free, without, [k for k in wide if k != i]))
    return min(starts, key=lambda start: start[0])[1]


def _liveliest(e: Experiment, samples: int) -> Experiment:
    """Return the stretch of so many samples with the largest variance of the set point.

    Without a set point, the variance of the first channel decides.
    """
    if e.samples <= samples:
        return e
    signal = e.current if len(e.current) else next(iter(e.readings.values()))
    begins = range(0, e.samples - samples + 1, samples)
    begin = max(begins, key=lambda i: float(np.nanvar(signal[i : i + samples])))
    return e.between(begin, begin + samples)


def _wide(c: Coordinate) -> bool:
    logarithmic = c.scaling in ("logarithmic", "vanishing")
    return not c.stated and logarithmic and c.prior * c.scale > WIDE


def _swept(
    fitter: Fitter, free: Sequence[Coordinate], best: Array, wide: Sequence[int]
) -> tuple[float, Array]:
    """Minimise the deviance over a few values of each wide parameter, one after the other."""
    least = _deviance(fitter, free, best)
    for i in wide:
        for tried in list(_levels(free[i], best, i)):
            deviance = _deviance(fitter, free, tried)
            if deviance < least - LEAST_GAIN:
                least, best = deviance, tried
    return least, best


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
