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
    units = slopes / np.sqrt(np.maximum(power, 1e-300))
    kept: dict[int, Coordinate] = {}
    for i in np.argsort(-power, kind="stable"):
        if power[i] < LEAST_CHI2:
            break
        collinear = [] if free[i].stated else [j for j in kept if not free[j].stated
                     and abs(units[:, i] @ units[:, j]) > ONE_PRODUCT]  # fmt: skip
        if not collinear:
            kept[i] = free[i]
            continue
        one, more = kept[collinear[0]], math.sqrt(power[i] / power[collinear[0]])
        also = (*one.also, free[i].field)
        kept[collinear[0]] = replace(one, prior=math.hypot(one.prior, more), also=also)
    return [kept[i] for i in sorted(kept)]
