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

FROM, TO = -2.0, 3.0
"""Range of the search, in prior standard deviations."""

FINE = 0.46
"""Logarithm of the ratio 1.6 of neighbouring values of the fine search. A rod that is held by the
bend of its seals resonates; with a stiffness 1.6 times off, its frequency is a quarter off."""

WITHOUT = 5.0
"""Upper bound, in prior standard deviations, from which it stands for a law without that part: a
presliding distance of 10 m leaves friction by velocity alone."""

NEARLY_ZERO = 0.8
"""Fraction of the distance to zero of the lowest value: at zero itself the derivative is zero, and
a fit would not leave it (assumed)."""

ENOUGH = 10_000
"""Samples of the search (assumed). With half of them, the wrong valley was chosen for one of six
machines."""

SHORTEST = 500
"""Samples of an experiment that are used at least (assumed)."""


def coarse_start(fitter: Fitter, free: Sequence[Coordinate]) -> Array:
    """Return the start of the first fit, near the global minimum of the deviance.

    Parameters with wide priors are searched at the values of the better one of two short fits, from
    configured values and after a coarse search. Usual effects remain zero. Of long data, the
    stretch with the strongest motion is used.

    Args:
        fitter: with the training data.
        free: all coordinates of the fit.

    Returns:
        Coordinates; zero if no prior is wide, or if the deviance is unknown.

    """
    at = np.zeros(len(free))
    wide = [i for i, c in enumerate(free) if _wide(c)]
    if not wide or math.isnan(_deviance(fitter, free, at)):
        return at
    most = max(ENOUGH // len(fitter.experiments), SHORTEST)
    fitter = fitter.on([_liveliest(e, most) for e in fitter.experiments])
    begins = at, _swept(fitter, free, at, wide, 1.0)[1]
    fitted = [_shortly_fitted(fitter, free, begin) for begin in begins]
    starts = [_swept(fitter, free, min(fitted, key=lambda one: one[0])[1], wide)]
    best = starts[0][1]
    # laws without one of their parts are another valley
    for i in (k for k in wide if free[k].bounds[1] > WITHOUT * free[k].prior):
        without = np.where(np.arange(len(best)) == i, free[i].bounds[1], best)
        starts.append(_swept(fitter, free, without, [k for k in wide if k != i]))
    return min(starts, key=lambda start: start[0])[1]


def _shortly_fitted(
    fitter: Fitter, free: Sequence[Coordinate], begin: Array
) -> tuple[float, Array]:
    """Return deviance and values after a short fit; usual effects remain zero."""
    at = np.array(begin)
    ordinary = [i for i, c in enumerate(free) if not is_usual(c)]
    at[ordinary] = converge(fitter, [free[i] for i in ordinary], at[ordinary], passes=1).at
    return _deviance(fitter, free, at), at


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
    fitter: Fitter, free: Sequence[Coordinate], best: Array, wide: Sequence[int],
    step: float | None = None,
) -> tuple[float, Array]:  # fmt: skip
    """Minimise the deviance over a few values of each wide parameter, one after the other.

    Args:
        fitter: with the data of the search.
        free: all coordinates of the fit.
        best: their values at the start.
        wide: indices of the parameters.
        step: between two values, in prior standard deviations; None for `FINE`.

    """
    least = _deviance(fitter, free, best)
    for i in wide:
        for tried in list(_levels(free[i], best, i, step or FINE / free[i].scale)):
            deviance = _deviance(fitter, free, tried)
            if deviance < least - LEAST_GAIN:
                least, best = deviance, tried
    return least, best


def _levels(c: Coordinate, at: Array, i: int, step: float) -> Iterator[Array]:
    """Yield a point with one coordinate at each level that is within its bounds."""
    low, high = c.bounds
    if c.scaling == "vanishing":
        low *= NEARLY_ZERO
    levels = np.clip(c.prior * np.arange(FROM, TO + 0.5 * step, step), low, high)
    for size in sorted({*levels.tolist()} - {float(at[i])}):
        yield np.where(np.arange(len(at)) == i, size, at)


def _deviance(fitter: Fitter, free: Sequence[Coordinate], at: Array) -> float:
    fitter.freeze(free, at)
    return fitter.deviance(free, at)
