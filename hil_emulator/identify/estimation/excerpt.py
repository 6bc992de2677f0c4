"""Excerpt of long recordings, on which candidates are screened before refits on all data.

The residuals of the excerpt are weighted so that its statistics estimate those of all data.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hil_emulator.identify.estimation.clusters import Clusters
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.measured.experiment import Array, Index, Single
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.windows import WINDOW, counted, first_samples, window
from hil_emulator.identify.prediction.parallel.pool import LocalBatch

ENOUGH = 10_000
"""Samples of an excerpt. An effect with 1 % of the variance of one channel, the smallest that is
named, gains 100 in chi-square in so many samples: five times the critical value."""


@dataclass(frozen=True)
class Excerpt:
    """Excerpt of the training data, and a fit restricted to it.

    Attributes:
        fitter: with the excerpt frozen.
        fit: coordinates, residual and Jacobian of the excerpt.
        rows: indices of its residuals among those of all data; None for all data.
        weights: of its residuals; 0 for excluded ones.

    """

    fitter: Fitter
    fit: Fit
    rows: Index | None = None
    weights: Array = field(default_factory=lambda: np.ones(1))

    def of(self, residual: Array) -> Array:
        """Return the excerpt of a residual of all data."""
        return residual if self.rows is None else residual[self.rows]

    def columns(self, columns: Array | Single) -> Array:
        """Return the excerpt of derivatives of the residual of all data, one column each."""
        if self.rows is None:
            return columns.astype(np.float64, copy=False)
        return np.asarray(self.weights[:, None] * columns[self.rows])

    def clusters(self, clusters: Clusters) -> Clusters:
        """Return the groups of the excerpt's residuals that may be correlated."""
        if self.rows is None or not len(clusters.places):
            return clusters
        return Clusters(clusters.length, clusters.places[self.rows])


def excerpt_of(fitter: Fitter, fit: Fit) -> Excerpt:
    """Return an excerpt of the training data with a fit restricted to it; all data if they are few.

    Args:
        fitter: with the training data frozen.
        fit: of the model.

    """
    samples = sum(e.samples for e in fitter.experiments)
    if samples <= ENOUGH or fitter.batch.noise is not None:
        return Excerpt(fitter, fit)
    frozen = [f for f in fitter.frozen if isinstance(f, Frozen)]
    if len(frozen) < len(fitter.experiments):
        return Excerpt(fitter, fit)
    windows, rows = _windows(frozen, ENOUGH / samples)
    count = np.concatenate([counted(w) for w in windows])
    weight = math.sqrt(sum(int(np.sum(counted(f))) for f in frozen) / int(np.sum(count)))
    batch = LocalBatch(fitter.predictor, windows, fitter.jobs, weight=weight)
    restricted = fitter.with_batch(batch)
    residual = restricted.residual(fit.coordinates, fit.at)
    weights = weight * count
    chi2 = restricted.loss(fit.coordinates, fit.at, residual)
    excerpt = Excerpt(restricted, replace(fit, residual=residual, chi2=chi2), rows, weights)
    return replace(excerpt, fit=replace(excerpt.fit, jacobian=excerpt.columns(fit.jacobian)))


def _windows(frozen: Sequence[Frozen], part: float) -> tuple[list[Frozen], Index]:
    """Return windows of recordings, and the indices of their residuals among all residuals."""
    windows: list[Frozen] = []
    rows: list[Index] = []
    end = 0
    for one in frozen:
        samples, channels = one.data.measured.shape
        length = min(samples, round(WINDOW / one.data.period))
        for first in first_samples(samples, length, part):
            windows.append(window(one, first, first + length))
            rows.append(end + np.arange(first * channels, (first + length) * channels))
        end += samples * channels
    return windows, np.concatenate(rows)
