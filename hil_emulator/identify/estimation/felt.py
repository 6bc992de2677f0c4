"""Which ordinary parameters the data feel, and which of them only as a product."""

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

FELT = 0.1
"""Chi-square that one standard deviation of a parameter makes, from which it is fitted: one that is
three off then costs half a nat, as chance does in a single number."""

ONE_PRODUCT = 0.999
"""Cosine between the derivatives by two unstated numbers, from which they are one: what
sets them apart is less than a twentieth of either."""


def felt(
    predictor: Predictor, experiments: Sequence[Experiment], free: Sequence[Coordinate],
    jobs: int = 1,
) -> list[Coordinate]:  # fmt: skip
    """Return the parameters that change the residual, those of one product as one coordinate.

    A number that is stated is felt as itself. Of those that are not, the one that moves the data
    the most stands for the product; it is as uncertain as all of them together.

    Args:
        predictor: computes residuals.
        experiments: the data.
        free: ordinary parameters.
        jobs: threads.

    """
    # with other forms of a law, numbers of one product differ in the last digits
    pool = Threads(predictor, jobs, exact=True)
    fitter, start = Fitter(predictor, experiments, pool), np.zeros(len(free))
    fitter.freeze(free, start)
    base = fitter.residual(free, start)
    slopes = fitter.jacobian(free, start, base)
    # a second time by the short steps that the first has shown to do: curves look like one another
    steep = np.flatnonzero(np.linalg.norm(slopes, axis=0) > LARGEST_CHANGE / DIFFERENCE).tolist()
    for i, column in zip(steep, fitter.columns([Derivative(free, start, i) for i in steep], base),
                         strict=True):  # fmt: skip
        slopes[:, i] = column
    fitter.release()
    return _told(free, slopes)


def _told(free: Sequence[Coordinate], slopes: Array) -> list[Coordinate]:
    """Return the coordinates whose slopes, shape (residuals, coordinates), are large enough."""
    power = np.sum(slopes**2, axis=0)
    units = slopes / np.sqrt(np.maximum(power, 1e-300))
    kept: dict[int, Coordinate] = {}
    for i in np.argsort(-power, kind="stable"):
        if power[i] < FELT:
            break
        alike = [] if free[i].stated else [j for j in kept if not free[j].stated
                 and abs(units[:, i] @ units[:, j]) > ONE_PRODUCT]  # fmt: skip
        if not alike:
            kept[i] = free[i]
            continue
        one, more = kept[alike[0]], math.sqrt(power[i] / power[alike[0]])
        also = (*one.also, free[i].field)
        kept[alike[0]] = replace(one, prior=math.hypot(one.prior, more), also=also)
    return [kept[i] for i in sorted(kept)]
