"""Pairs of candidates that hide each other.

A friction that is larger one way and a pressure reading that is off act against each other: each
alone explains little, both together nearly all. Taking one at a time would begin with a third.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.pool import Batch
from hil_emulator.identify.selection.candidate_refit import CandidateRefits, Trial
from hil_emulator.identify.selection.parts import GREATER_PART
from hil_emulator.identify.selection.scan import Projection, Score, score_of

FURTHER = 1.25
"""Times what the best candidate and its best partner explain that a pair must explain (assumed)."""

COLLINEAR = 0.95
"""Squared cosine between the sensitivities of two candidates above which they are one (assumed)."""

MOST_PAIRS = 4
"""Most pairs that are tried in the model."""

PARTNER_ITERATIONS = 3
"""Iterations of a refit with the first of a pair."""


@dataclass(frozen=True)
class Pair:
    """Two candidates, and what the linear model expects of both.

    Attributes:
        scores: of each by itself.
        sizes: of each beside the other, in typical sizes.
        delta_chi2: in chi-square, of both.

    """

    scores: tuple[Score, Score]
    sizes: tuple[float, float]
    delta_chi2: float


class Lookahead:
    """Tries pairs where one candidate at a time would go astray.

    Args:
        fitter: with the training data frozen.
        base: the fit without any candidate, where the scores were taken.
        held: frozen validation data, or None.
        needed: gain in chi-square that a name needs.

    """

    def __init__(self, fitter: Fitter, base: Fit, held: Batch | None, needed: float) -> None:
        self._fitter, self._base, self._held, self._needed = fitter, base, held, needed

    def leader(self, pairs: Sequence[Pair], alone: float) -> Trial | None:
        """Return the candidate to begin with, judged beside its partner; None without a pair.

        Args:
            pairs: the likeliest first, see `pairs_of`.
            alone: what the best single candidate gains.

        """
        for pair in pairs:
            if self._delta_chi2(pair) < GREATER_PART * pair.delta_chi2:
                continue
            first, second = pair.scores
            trials = [self._beside(first, second), self._beside(second, first)]
            deltas = [self._base.chi2 - t.fit.chi2 for t in trials]
            if all(t.evidence.passed for t in trials) and min(deltas) > FURTHER * alone:
                best = max(trials, key=lambda t: t.evidence.delta_chi2)
                return replace(best, fit=best.fit.without([best.beside]))
        return None

    def _delta_chi2(self, pair: Pair) -> float:
        """Return what the model itself gains where the linear one puts a pair."""
        base = self._base
        free = [*base.coordinates, *(s.coordinate for s in pair.scores)]
        moved = sum(x * s.response for x, s in zip(pair.sizes, pair.scores, strict=True))
        at = np.append(base.at + moved, pair.sizes)
        return base.chi2 - self._fitter.loss(free, at, self._fitter.residual(free, at))

    def _beside(self, first: Score, second: Score) -> Trial:
        """Judge a candidate in a model that has another one already."""
        at = np.append(self._base.at, 0.0)
        free = [*self._base.coordinates, first.coordinate]
        model = self._fitter.fit(free, at, PARTNER_ITERATIONS)
        sensitivity = self._fitter.column(
            [*free, second.coordinate], np.append(model.at, 0.0), model.residual, len(free)
        )
        score = score_of(second.coordinate, sensitivity, Projection(model))
        refits = CandidateRefits(self._fitter, model, self._held, self._needed)
        trial = refits.refit([score])[0]
        return replace(trial, score=second.lean(), beside=first.coordinate.name)


def pairs_of(scores: Sequence[Score], fit: Fit) -> list[Pair]:
    """Return pairs that explain clearly more than the best candidate with any partner.

    Args:
        scores: of all candidates.
        fit: where they were taken.

    """
    able = [s for s in scores if s.visible]
    if len(able) < 2:
        return []
    columns = np.stack([s.column for s in able])
    normal = (columns @ columns.T).astype(np.float64)
    gradient = -(columns @ Projection(fit).residual.astype(np.float32)).astype(np.float64)
    sizes, deltas = _jointly(normal, gradient)
    ends = np.array([s.coordinate.bounds for s in able])
    inside = (sizes >= ends[:, :1]) & (sizes <= ends[:, 1:])
    deltas = np.where(inside & inside.T, deltas, 0.0)
    best = max(range(len(able)), key=lambda i: able[i].statistic)
    least = FURTHER * max(float(np.max(deltas[best])), able[best].statistic)
    found = _above(deltas, least)
    return [Pair((able[i], able[j]), (float(sizes[i, j]), float(sizes[j, i])), float(deltas[i, j]))
            for i, j in islice(found, MOST_PAIRS)]  # fmt: skip


def _jointly(normal: Array, gradient: Array) -> tuple[Array, Array]:
    """Return the size of each candidate beside each other one, and what both gain."""
    power = np.diag(normal)
    room = np.outer(power, power) - normal**2
    apart = room > (1.0 - COLLINEAR) * np.outer(power, power)
    sizes = np.where(
        apart, gradient[:, None] * power - normal * gradient, 0.0
    ) / np.where(apart, room, 1.0)  # fmt: skip
    parts = sizes * gradient[:, None]
    return sizes, parts + parts.T


def _above(deltas: Array, least: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs that gain more than the least, the best first."""
    upper = np.triu(deltas, 1)
    for flat in np.argsort(-upper, axis=None):
        i, j = np.unravel_index(flat, upper.shape)
        if upper[i, j] <= least:
            return
        yield int(i), int(j)
