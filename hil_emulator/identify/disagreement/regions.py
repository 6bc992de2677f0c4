"""Which balance disagrees, and in which region of the state space.

A balance's share is what terms in it explain of everything that terms in any balance explain, taken
one after the other, the strongest first: so the shares add up. Ordinary parameters are projected
out. A term's gain falls on single samples, and a region is the simplest statement about the state
that covers most of the gain in little of the time.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm, combined
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array, Mask
from hil_emulator.identify.prediction.free_terms.regressors import Regressors

LEAST_FURTHER_SHARE = 0.02
"""Share of the gap below which a further term is not worth a line (assumed)."""

CONCENTRATED = 0.15
"""Least excess of a region's share of the gap over its share of the time (assumed)."""

COVERED = 0.8
"""Share of a balance's gap at which no further region is looked for (assumed)."""

MOST_REGIONS = 3
"""Regions that are told of one balance."""

BORDER_QUANTILES = np.linspace(0.05, 0.95, 19)
"""Quantiles of a regressor at which a region may begin or end."""


@dataclass(frozen=True)
class Region:
    """A part of the state space.

    Attributes:
        words: the region in words.
        share: share of the balance's gap that lies there.
        time: share of the time that the machine spent there.

    """

    words: str
    share: float
    time: float

    def __str__(self) -> str:
        return f"{self.words}: {100 * self.share:.0f} % in {100 * self.time:.0f} % of the time"


@dataclass(frozen=True)
class Disagreement:
    """A balance that the model does not meet.

    Attributes:
        balance: its name.
        regressor: what its strongest term depends on.
        share: share of the gap that terms in this balance explain.
        delta_chi2: gain in chi-square of these terms.
        regions: where in the state space, the largest share first.

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
        """The balance, over what, and its share where others disagree, too."""
        told = f"{self.balance} over {self.regressor}"
        if self.share > 1.0 - LEAST_FURTHER_SHARE:
            return told
        return f"{told}: {100 * self.share:.0f} % of what the balances lack"


def disagreements(
    fit: Fit, terms: Sequence[DiscrepancyTerm], states: Regressors, channels: int
) -> list[Disagreement]:
    """Return the balances that disagree, the largest share first.

    Args:
        fit: the model.
        terms: those that are worth a word there.
        states: regressors along the trajectory, all experiments in a row.
        channels: residuals per sample.

    """
    chosen = _chosen([t for t in terms if t.columns.size], fit)
    total = sum(delta_chi2 for _, delta_chi2, _ in chosen)
    found: dict[str, Disagreement] = {}
    for term, delta_chi2, local in chosen:
        name, samples = term.balance.name, local.reshape(-1, channels).sum(axis=1)
        known = found.get(name)
        if known is None:
            regions = tuple(_regions(samples, states))
            found[name] = Disagreement(
                name, term.regressor, delta_chi2 / total, delta_chi2, regions
            )
        else:
            share = known.share + delta_chi2 / total
            found[name] = Disagreement(
                name, known.regressor, share, known.delta_chi2 + delta_chi2, known.regions
            )  # fmt: skip
    return sorted(found.values(), key=lambda d: -d.share)


def _chosen(
    terms: Sequence[DiscrepancyTerm], fit: Fit
) -> list[tuple[DiscrepancyTerm, float, Array]]:
    """Return terms one after the other with their further gain, in all and by residual."""
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
            bases[id(other)] = _beside(bases[id(other)], basis)
    return chosen


def _basis(term: DiscrepancyTerm, project: Projection) -> Array:
    columns = np.empty((len(project.residual), term.columns.shape[1]))
    for i, column in enumerate(term.columns.T):
        columns[:, i] = project(column)
    return _orthonormal(columns)


def _beside(basis: Array, other: Array) -> Array:
    """Return a basis of what is not in another one."""
    own = basis.astype(np.float64)
    own -= other @ (other.T @ own)
    return _orthonormal(own)


def _orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis, without directions that hardly exist: perhaps of none.

    What is given is overwritten.
    """
    values, vectors = np.linalg.eigh(columns.T @ columns)
    keep = values > max(1e-4 * float(np.max(values, initial=0.0)), 1e-9)
    # of a long recording the bases of all terms are large
    basis = combined(columns, vectors[:, keep] / np.sqrt(values[keep]))
    return np.asarray(basis.astype(np.float32))


def _regions(delta_chi2: Array, states: Regressors) -> Iterator[Region]:
    """Yield the regions in which most of a gain lies."""
    total, left = float(np.sum(delta_chi2)), np.ones(len(delta_chi2), bool)
    told = 0.0
    for _ in range(MOST_REGIONS):
        best, score = None, CONCENTRATED
        for words, inside in _statements(states):
            here = inside & left
            share, time = float(np.sum(delta_chi2[here])) / total, float(np.mean(inside))
            if share - time > score and 0.02 < time < 0.9:
                best, score = (words, here, share, time), share - time
        if best is None:
            return
        words, here, share, time = best
        yield Region(words, min(share, 1.0), time)
        told += share
        left &= ~here
        if told > COVERED:
            return


def _statements(states: Regressors) -> Iterator[tuple[str, Mask]]:
    """Yield simple statements about the state, with the samples for which they hold."""
    v, x = states["velocity"], states["position"]
    ways = (("both directions", np.ones(len(v), bool)), ("extending", v > 0.0),
            ("retracting", v < 0.0))  # fmt: skip
    for level in _levels(np.abs(v), 1e3):
        for way, moving in ways:
            yield f"|v| < {level:g} mm/s, {way}", (np.abs(v) < level * 1e-3) & moving
            yield f"|v| > {level:g} mm/s, {way}", (np.abs(v) > level * 1e-3) & moving
    places = _levels(x, 1e3)
    for i, low in enumerate(places):
        yield f"x < {low:g} mm", x < low * 1e-3
        yield f"x > {low:g} mm", x > low * 1e-3
        for high in places[i + 1 :]:
            yield f"{low:g} mm < x < {high:g} mm", (x > low * 1e-3) & (x < high * 1e-3)
    for name, label, scale in (
        ("spool position", "mA", 1e3), ("pressure a", "bar", 1e-5), ("pressure b", "bar", 1e-5),
        ("pressure difference", "bar", 1e-5),
    ):  # fmt: skip
        for level in _levels(states[name], scale) if name in states else ():
            yield f"{name} < {level:g} {label}", states[name] * scale < level
            yield f"{name} > {level:g} {label}", states[name] * scale > level


def _levels(values: Array, scale: float) -> list[float]:
    """Return levels at the quantiles of some values, with two digits."""
    found = np.quantile(values * scale, BORDER_QUANTILES)
    return sorted({float(f"{v:.2g}") for v in found})
