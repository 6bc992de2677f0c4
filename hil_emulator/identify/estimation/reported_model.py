"""What is told of a finished model: values beside friction that ripples, and how sure they are."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, Linearised
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.estimation.ripple import Along, Ripple, ripples
from hil_emulator.identify.estimation.sizes import Sizes, parts_of_each
from hil_emulator.identify.measured.experiment import Array, Single
from hil_emulator.identify.prediction.plant.coordinate import Coordinate


@dataclass(frozen=True)
class ReportedModel:
    """A finished model as it is told.

    Attributes:
        fit: where it is likeliest, the ripple of the friction integrated out.
        deviations: standard deviation of each coordinate, by name.
        sizes: what size each experiment wants of each effect, by name.
        terms: free terms that chance hardly explains beside the ripple.

    """

    fit: Fit
    deviations: Mapping[str, float]
    sizes: Mapping[str, Sizes]
    terms: Sequence[DiscrepancyTerm]


def report_model(
    fitter: Fitter, fit: Fit, effects: Sequence[Coordinate], elsewhere: Linearised | None,
    terms: Sequence[DiscrepancyTerm],
) -> ReportedModel | None:  # fmt: skip
    """Return what is told of a model; None where no place of the stroke is seen.

    Args:
        fitter: with the training data, frozen where the fit ended.
        fit: the model.
        effects: that were named.
        elsewhere: validation data as the fit sees them.
        terms: what free terms explain beside the model.

    """
    if not ripples(fitter, fit):
        return None
    ripple = Ripple(fitter, fit)
    named, every = [c.name for c in effects], [c.name for c in fit.coordinates]
    trained = list(ripple.along(every))
    left = np.concatenate([one.left for one in trained])
    parts = parts_of_each(len(trained) + (len(elsewhere.batch.frozen) if elsewhere else 0))
    sizes: dict[str, Sizes] = {}
    for name in named:
        i = every.index(name)
        sizes[name] = Sizes(float(ripple.fit.at[i]), fitter.correlation_length)
        for one in trained:
            sizes[name].add(one.name, *_told(one, i, ripple.beyond[i]), parts)
    for one in ripple.along(named, elsewhere) if elsewhere else ():
        for k, name in enumerate(named):
            beyond = ripple.beyond[every.index(name)]
            sizes[name].add(one.name, *_told(one, k, beyond), parts)
    return ReportedModel(
        ripple.fit, _deviations(fitter, ripple.fit, trained, left), sizes,
        _remaining(fitter, replace(fit, residual=left), terms),
    )  # fmt: skip


def _told(one: Along, i: int, beyond: float) -> tuple[Single, Array]:
    """Return what a coordinate does, and what is left where it is as it is told."""
    shown = one.shown[i]
    return shown, one.left + beyond * shown if beyond else one.left


def _deviations(
    fitter: Fitter, fit: Fit, trained: Sequence[Along], left: Array
) -> dict[str, float]:  # fmt: skip
    """Return the standard deviation of each coordinate, what lasts counted.

    It widens what the data tell, and not what is believed.
    """
    clusters, found = fitter.clusters, {}
    for i, variance in enumerate(np.diag(fit.covariance()).tolist()):
        shown = np.concatenate([one.shown[i] for one in trained]).astype(np.float64)
        widened = clusters.variance_factor(shown, left) - 1.0
        part = min(variance * float(shown @ shown), 1.0)
        found[fit.coordinates[i].name] = math.sqrt(variance * (1.0 + part * widened))
    return found


def _remaining(
    fitter: Fitter, beside: Fit, terms: Sequence[DiscrepancyTerm]
) -> list[DiscrepancyTerm]:
    """Return those terms that chance hardly explains beside the ripple as well."""
    titles = [t.title for t in terms if t.significant and not t.ripples]
    if not titles:
        return []
    again = score_terms(fitter, beside.coordinates, beside.at, Projection(beside), only=titles)
    return [t for t in again if t.significant]
