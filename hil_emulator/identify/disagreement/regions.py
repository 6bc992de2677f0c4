"""Balances that disagree, and the regions of the state space in which they do.

Free terms are added one after the other, the strongest first. A balance's share is the gain of its
terms relative to that of all terms, so the shares add up to 1. Ordinary parameters are projected
out. A term's gain is a sum over samples. A region is a simple condition on the state under which
much of the gain lies in a small share of the time.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.disagreement.residuals import shown_as
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, combined
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array, Mask
from hil_emulator.identify.prediction.free_terms.regressors import Regressors

LEAST_FURTHER_SHARE = 0.02
"""Smallest share of the gap of a further term (assumed)."""

CONCENTRATED = 0.15
"""Smallest difference of a region's share of the gap and its share of the time (assumed)."""

COVERED = 0.8
"""Share of a balance's gap at which the search for regions ends (assumed)."""

MOST_REGIONS = 3
"""Largest number of regions per balance."""

BORDER_QUANTILES = np.linspace(0.05, 0.95, 19)
"""Quantiles of a regressor at which a region may begin or end."""


@dataclass(frozen=True)
class Region:
    """A part of the state space.

    Attributes:
        words: the region in words.
        share: share of the balance's gap in the region.
        time: share of the time in the region.

    """

    words: str
    share: float
    time: float

    def __str__(self) -> str:
        return f"{self.words}: {100 * self.share:.0f} % in {100 * self.time:.0f} % of the time"


@dataclass(frozen=True)
class Disagreement:
    """A balance in which the model disagrees.

    Attributes:
        balance: its name.
        regressor: the quantity on which its strongest term depends.
        share: share of the gap that terms in this balance explain.
        delta_chi2: gain in chi-square of these terms.
        regions: of the state space, the largest share first.

    """

    balance: str
    regressor: str
    share: float
    delta_chi2: float
    regions: tuple[Region, ...]

    def __str__(self) -> str:
        where = f", {self.regions[0]}" if self.regions else ", everywhere"
        return f"{self.place}{where}"

    @property
    def place(self) -> str:
        """The balance with its regressor, and its share if several balances disagree."""
        place = f"{self.balance} over {self.regressor}"
        if self.share > 1.0 - LEAST_FURTHER_SHARE:
            return place
        return f"{place}: {100 * self.share:.0f} % of what the balances lack"


def disagreements(
    fit: Fit, terms: Sequence[DiscrepancyTerm], states: Regressors, channels: int
) -> list[Disagreement]:
    """Return the balances that disagree, the largest share first.

    Args:
        fit: the model.
        terms: the noticeable free terms.
        states: regressors along the trajectory, experiments concatenated.
        channels: number of residuals per sample.

    """
    chosen = _chosen([t for t in terms if t.columns.size], fit)
    total = sum(delta_chi2 for _, delta_chi2, _ in chosen)
    by_balance: dict[str, Disagreement] = {}
    for term, delta_chi2, local in chosen:
        name, samples = term.balance.name, local.reshape(-1, channels).sum(axis=1)
        previous = by_balance.get(name)
        if previous is None:
            regions = tuple(_regions(samples, states))
            by_balance[name] = Disagreement(
                name, term.regressor, delta_chi2 / total, delta_chi2, regions
            )
        else:
            share = previous.share + delta_chi2 / total
            by_balance[name] = Disagreement(
                name, previous.regressor, share, previous.delta_chi2 + delta_chi2, previous.regions
            )  # fmt: skip
    return sorted(by_balance.values(), key=lambda d: -d.share)


def _chosen(
    terms: Sequence[DiscrepancyTerm], fit: Fit
) -> list[tuple[DiscrepancyTerm, float, Array]]:
    """Return the terms in order of their additional gains, with the gain in all and by residual."""
    project = Projection(fit)
    rest = list(terms)
    bases = {id(t): _basis(t, project) for t in rest}
    residual, chosen = project.residual.copy(), []
    count, first = len(fit.residual), 0.0
    while rest:
        deltas = [float(np.sum((bases[id(t)].T @ residual) ** 2)) for t in rest]
        best = int(np.argmax(deltas))
        term, delta_chi2 = rest.pop(best), deltas[best]
        first = first or delta_chi2
        if delta_chi2 < max(LEAST_FURTHER_SHARE * first, term.limit):
            break
        basis = bases.pop(id(term))
        after = residual - basis @ (basis.T @ residual)
        chosen.append((term, delta_chi2, (residual**2 - after**2)[:count]))
        residual = after
        for other in rest:
            bases[id(other)] = _without(bases[id(other)], basis)
    return chosen


def _basis(term: DiscrepancyTerm, project: Projection) -> Array:
    columns = np.empty((len(project.residual), term.columns.shape[1]))
    for i, column in enumerate(term.columns.T):
        columns[:, i] = project(column)
    return _orthonormal(columns)


def _without(basis: Array, other: Array) -> Array:
    """Return a basis of the part orthogonal to another basis."""
    rest = basis.astype(np.float64)
    rest -= other @ (other.T @ rest)
    return _orthonormal(rest)


def _orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis without nearly dependent directions; it may be empty.

    The given columns are overwritten.
    """
    values, vectors = np.linalg.eigh(columns.T @ columns)
    keep = values > max(1e-4 * float(np.max(values, initial=0.0)), 1e-9)
    # single precision: the bases of a long recording need much memory
    basis = combined(columns, vectors[:, keep] / np.sqrt(values[keep]))
    return np.asarray(basis.astype(np.float32))


def _regions(delta_chi2: Array, states: Regressors) -> Iterator[Region]:
    """Yield the regions with most of a gain."""
    total, left = float(np.sum(delta_chi2)), np.ones(len(delta_chi2), bool)
    covered = 0.0
    for _ in range(MOST_REGIONS):
        best, score = None, CONCENTRATED
        for words, inside in _conditions(states):
            here = inside & left
            share, time = float(np.sum(delta_chi2[here])) / total, float(np.mean(inside))
            if share - time > score and 0.02 < time < 0.9:
                best, score = (words, here, share, time), share - time
        if best is None:
            return
        words, here, share, time = best
        yield Region(words, min(share, 1.0), time)
        covered += share
        left &= ~here
        if covered > COVERED:
            return


def _conditions(states: Regressors) -> Iterator[tuple[str, Mask]]:
    """Yield simple conditions on the state, with the samples that meet them."""
    v, x = states["velocity"], states["position"]
    ways = (("both directions", np.ones(len(v), bool)), ("extending", v > 0.0),
            ("retracting", v < 0.0))  # fmt: skip
    scale, unit = shown_as("m/s")
    speed = np.abs(v) * scale
    for level in _levels(speed):
        for way, moving in ways:
            yield f"|v| < {level:g} {unit}, {way}", (speed < level) & moving
            yield f"|v| > {level:g} {unit}, {way}", (speed > level) & moving
    scale, unit = shown_as("m")
    place = x * scale
    places = _levels(place)
    for i, low in enumerate(places):
        yield f"x < {low:g} {unit}", place < low
        yield f"x > {low:g} {unit}", place > low
        for high in places[i + 1 :]:
            yield f"{low:g} {unit} < x < {high:g} {unit}", (place > low) & (place < high)
    for name, label, scale in (
        ("spool position", "mA", 1e3), ("pressure a", "bar", 1e-5), ("pressure b", "bar", 1e-5),
        ("pressure difference", "bar", 1e-5),
    ):  # fmt: skip
        for level in _levels(states[name] * scale) if name in states else ():
            yield f"{name} < {level:g} {label}", states[name] * scale < level
            yield f"{name} > {level:g} {label}", states[name] * scale > level


def _levels(values: Array) -> list[float]:
    """Return levels at the quantiles of some values, with two digits."""
    quantiles = np.quantile(values, BORDER_QUANTILES)
    return sorted({float(f"{v:.2g}") for v in quantiles})
