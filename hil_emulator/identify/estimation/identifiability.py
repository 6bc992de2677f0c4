"""Selection of the ordinary parameters, and products of them, that the data determine."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.finite_difference import (
    DIFFERENCE,
    LARGEST_CHANGE,
    Derivative,
)
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import Threads
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

LEAST_CHI2 = 0.1
"""Chi-square of one prior standard deviation of a parameter from which it is fitted. Below it, an
error of three standard deviations costs less than half a nat."""

ONE_PRODUCT = 0.999
"""Cosine between the derivatives by two unstated parameters above which only their product is
fitted: they then differ by less than 5 %."""

LEAST_APART = 1.0
"""Chi-square of one prior standard deviation, without the part along another parameter, up to which
only their product is fitted: the prior determines the parameter more precisely than the data."""

MOSTLY = 0.5
"""Smallest squared cosine between such parameters: the greater part is common."""


def identifiable(
    predictor: Predictor, experiments: Sequence[Experiment], free: Sequence[Coordinate],
    jobs: int = 1,
) -> list[Coordinate]:  # fmt: skip
    """Return the parameters that change the residual, with one coordinate per product.

    Stated parameters are never combined. Of collinear unstated parameters, the one with the largest
    influence represents the product; its prior variance is the sum of their prior variances.

    Args:
        predictor: computes residuals.
        experiments: the training data.
        free: ordinary parameters.
        jobs: threads.

    """
    fitter, start = Fitter(predictor, experiments, Threads(predictor, jobs)), np.zeros(len(free))
    fitter.freeze(free, start)
    base = fitter.residual(free, start)
    slopes = fitter.jacobian(free, start, base)
    # again with shorter steps where the residual changed much: curvature hides collinearity
    steep = np.flatnonzero(np.linalg.norm(slopes, axis=0) > LARGEST_CHANGE / DIFFERENCE).tolist()
    for i, column in zip(steep, fitter.columns([Derivative(free, start, i) for i in steep], base),
                         strict=True):  # fmt: skip
        slopes[:, i] = column
    fitter.release()
    return _combined(free, slopes)


def _combined(free: Sequence[Coordinate], slopes: Array) -> list[Coordinate]:
    """Return the coordinates whose slopes, shape (residuals, coordinates), are large enough."""
    power = np.sum(slopes**2, axis=0)
    kept: dict[int, Coordinate] = {}
    for i in np.argsort(-power, kind="stable"):
        if power[i] < LEAST_CHI2:
            break
        others = [] if free[i].stated else [j for j in kept if not free[j].stated]
        j = _inseparable(slopes[:, i], slopes[:, others])
        if j is None:
            kept[i] = free[i]
            continue
        one, more = kept[others[j]], math.sqrt(power[i] / power[others[j]])
        also = (*one.also, free[i].field)
        kept[others[j]] = replace(one, prior=math.hypot(one.prior, more), also=also)
    return [kept[i] for i in sorted(kept)]


def _inseparable(slope: Array, others: Array) -> int | None:
    """Return the index of the most similar slope, if the data determine only the product."""
    cosines = np.abs(slope @ others) / np.linalg.norm(others, axis=0) / np.linalg.norm(slope)
    if not len(cosines) or cosines.max() ** 2 < MOSTLY:
        return None
    apart = float(slope @ slope) * (1.0 - cosines.max() ** 2)
    return int(cosines.argmax()) if cosines.max() > ONE_PRODUCT or apart < LEAST_APART else None
