"""Reported values of a final model, with friction ripple integrated out, and their uncertainty."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from hil_emulator.identify.estimation.experiment_estimates import (
    EstimatesByExperiment,
    parts_per_experiment,
)
from hil_emulator.identify.estimation.fit import Fit, Linearised
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.estimation.ripple import Profiled, Ripple, ripple_applies
from hil_emulator.identify.measured.experiment import Array, Single


@dataclass(frozen=True)
class ReportedModel:
    """Reported values of a final model.

    Attributes:
        fit: maximum of the likelihood with the friction ripple integrated out.
        deviations: standard deviation of each coordinate, by name.
        estimates: estimates of each coordinate from single experiments, by name.
        terms: free terms that are significant in addition to the ripple.

    """

    fit: Fit
    deviations: Mapping[str, float]
    estimates: Mapping[str, EstimatesByExperiment]
    terms: Sequence[DiscrepancyTerm]

    def deviation(self, name: str) -> float:
        """Return the standard deviation of an ordinary parameter with other laws than the model's.

        Args:
            name: of the coordinate.

        """
        return math.hypot(self.deviations[name], self.estimates[name].of_mean)


def report_model(
    fitter: Fitter, fit: Fit, held: Linearised | None, terms: Sequence[DiscrepancyTerm]
) -> ReportedModel | None:
    """Return the reported values; None if friction ripple cannot be modelled.

    Args:
        fitter: with the training data, frozen at the fit.
        fit: of the final model.
        held: validation data linearised at the fit, or None.
        terms: free terms, scored at the fit.

    """
    if not ripple_applies(fitter, fit):
        return None
    ripple = Ripple(fitter, fit)
    every = [c.name for c in fit.coordinates]
    trained = list(ripple.profiled(every))
    residual = np.concatenate([one.residual for one in trained])
    parts = parts_per_experiment(len(trained) + (len(held.batch.frozen) if held else 0))
    estimates = {c.name: EstimatesByExperiment(float(at), fitter.correlation_length, prior=c.prior)
                 for c, at in zip(fit.coordinates, ripple.fit.at, strict=True)}  # fmt: skip
    for one in chain(trained, ripple.profiled(every, held) if held else ()):
        for i, name in enumerate(every):
            estimates[name].add(one.name, *_at_estimate(one, i, ripple.nonlinear_shift[i]), parts)
    return ReportedModel(
        ripple.fit, _deviations(fitter, ripple.fit, trained, residual), estimates,
        _remaining(fitter, replace(fit, residual=residual), terms),
    )  # fmt: skip


def _at_estimate(one: Profiled, i: int, shift: float) -> tuple[Single, Array]:
    """Return the projected column of a coordinate, and the residual at its reported value."""
    column = one.columns[i]
    return column, one.residual + shift * column if shift else one.residual


def _deviations(
    fitter: Fitter, fit: Fit, trained: Sequence[Profiled], residual: Array
) -> dict[str, float]:  # fmt: skip
    """Return the standard deviation of each coordinate, with serial correlation.

    Correlation increases only the share of the variance that comes from the data, not the prior's.
    """
    clusters, deviations = fitter.clusters, {}
    for i, variance in enumerate(np.diag(fit.covariance()).tolist()):
        column = np.concatenate([one.columns[i] for one in trained]).astype(np.float64)
        widened = clusters.variance_factor(column, residual) - 1.0
        part = min(variance * float(column @ column), 1.0)
        deviations[fit.coordinates[i].name] = math.sqrt(variance * (1.0 + part * widened))
    return deviations


def _remaining(fitter: Fitter, fit: Fit, terms: Sequence[DiscrepancyTerm]) -> list[DiscrepancyTerm]:
    """Return those terms that are significant with the ripple removed from the residual, too."""
    titles = [t.title for t in terms if t.significant and not t.ripples]
    if not titles:
        return []
    again = score_terms(fitter, fit.coordinates, fit.at, Projection(fit), only=titles)
    return [t for t in again if t.significant]
