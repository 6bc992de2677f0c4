"""An excerpt of long recordings: where candidates are looked for, before they are fitted to all.

Which candidates are likely, a part of long recordings shows as well as the whole. Statistics in it
stand for all of the data: its residuals count as often as there are more of these.
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
"""Samples that show which candidates are likely: what makes 1 % of the variance of one channel,
below which a name is too faint, gains 100 in chi-square there, five times what a name needs."""


@dataclass(frozen=True)
class Excerpt:
    """Training data in which candidates are looked for, and a fit as it is seen there.

    Attributes:
        fitter: with the excerpt frozen.
        fit: coordinates, residual and Jacobian there.
        rows: which residuals of all data these are; None for all of them.
        weights: of these residuals, how often they count and whether.

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
        """Return which residuals of the excerpt may be correlated, from those of all data."""
        if self.rows is None or not len(clusters.places):
            return clusters
        return Clusters(clusters.length, clusters.places[self.rows])


def excerpt_of(fitter: Fitter, fit: Fit) -> Excerpt:
    """Return an excerpt of the training data as it is seen by a fit; all of them if they are few.

    Args:
        fitter: with the training data frozen.
        fit: of everything in the model.

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
    seen = fitter.seeing(LocalBatch(fitter.predictor, windows, fitter.jobs, weight=weight))
    residual = seen.residual(fit.coordinates, fit.at)
    weights = weight * count
    chi2 = seen.loss(fit.coordinates, fit.at, residual)
    there = Excerpt(seen, replace(fit, residual=residual, chi2=chi2), rows, weights)
    return replace(there, fit=replace(there.fit, jacobian=there.columns(fit.jacobian)))


def _windows(frozen: Sequence[Frozen], part: float) -> tuple[list[Frozen], Index]:
    """Return windows of recordings, and which of the residuals of all of them theirs are."""
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
