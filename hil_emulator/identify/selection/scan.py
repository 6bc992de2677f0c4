"""Score tests of single candidates and pairs, with the ordinary parameters projected out."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from hil_emulator.identify.estimation.finite_difference import Derivative
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import DISTINGUISHABLE, NEARLY_ALL, SMALL_PART

NO_EFFECT = 1e-6
"""Information (gain in chi-square at typical size) up to which an effect is rounding error: of a
thousand times its typical size, the gain would be 1."""

LEAST_COARSE_PART = 0.1
"""Share of the best candidate's gain below which a sensor error keeps its approximate sensitivity
(assumed)."""

ROWS_AT_ONCE = 4096
"""Rows of the candidates' columns per matrix product; limits the memory."""

MOST_PAIRS = 4
"""Largest number of pairs that are refitted."""


@dataclass(frozen=True)
class Score:
    """Score test of one candidate in the linearised model.

    Attributes:
        coordinate: the candidate.
        statistic: expected gain in chi-square.
        estimate: linear estimate, in typical sizes.
        information: squared norm of `column`: gain in chi-square of the effect at typical size.
        column: sensitivity with the ordinary parameters projected out; empty after `Round.slim`.
        sensitivity: derivative of the residual with respect to the candidate; empty if lean.
        response: derivative of the ordinary parameters' estimates with respect to the candidate.
        start: starting point of a refit; None for the linear estimate.
        remaining: share of the residual variance that is left with the candidate in the model, if
            the noise is estimated; otherwise 1.

    """

    coordinate: Coordinate
    statistic: float
    estimate: float
    information: float
    column: Array
    sensitivity: Array
    response: Array
    start: Array | None = None
    remaining: float = 1.0

    @property
    def visible(self) -> bool:
        """Whether the effect at its typical size would be significant in these data."""
        return self.information > DISTINGUISHABLE * self.remaining

    @property
    def flat(self) -> bool:
        """Whether the candidate is an inactive limit, whose sensitivity is zero."""
        return self.coordinate.inverse and self.information <= NO_EFFECT

    def lean(self) -> "Score":
        """Return the score without its sensitivity, which is large for long recordings."""
        return replace(self, sensitivity=np.zeros(0))


def size_penalty(size: float) -> float:
    """Return -2 log p(size)/p(0) for a Cauchy prior on the size.

    The heavy tails allow sizes of 10 or 100 times the typical one if the data require them (Gelman
    et al. 2008, Annals of Applied Statistics 2, 1360-1383).

    Args:
        size: in typical sizes.

    """
    return 2.0 * math.log1p(size * size)


def scan(fitter: Fitter, fit: Fit, candidates: Sequence[Coordinate]) -> list[Score]:
    """Return the candidates' scores, best first.

    Approximate sensitivities of sensor errors are cheap. They are replaced by exact ones only for
    candidates that explain at least `LEAST_COARSE_PART` of what the best one explains.
    """
    project = Projection(fit)
    at, last = np.append(fit.at, 0.0), len(fit.at)

    def scored(some: Sequence[Coordinate], approximate: bool) -> dict[str, Score]:
        wanted = [Derivative([*fit.coordinates, c], at, last) for c in some]
        columns = fitter.columns(wanted, fit.residual, approximate)
        return {c.name: score_of(c, column.astype(np.float32), project)
                for c, column in zip(some, columns, strict=True)}  # fmt: skip

    scores = scored(candidates, approximate=True)
    least = max((LEAST_COARSE_PART * s.statistic for s in scores.values()), default=0.0)
    likely = [c for c in candidates if c.channel and scores[c.name].statistic > least]
    scores |= scored(likely, approximate=False)
    return sorted(scores.values(), key=lambda s: -s.statistic)


def score_of(candidate: Coordinate, sensitivity: Array, project: Projection) -> Score:
    """Return the score of a candidate from its sensitivity or from a secant to some size."""
    response = project.response(sensitivity)
    column = project(sensitivity, response)
    information = float(column @ column)
    gradient = float(column @ project.residual)
    low, high = candidate.bounds
    estimate = 0.0
    if information > NO_EFFECT:
        estimate = float(np.clip(-gradient / information, low, high))
    expected = -2.0 * estimate * gradient - estimate**2 * information
    power = float(project.residual @ project.residual)
    remaining = 1.0 - expected / power if project.estimated and 0.0 < expected < power else 1.0
    return Score(
        candidate,
        max(expected, 0.0),
        estimate,
        information,
        column.astype(np.float32),
        sensitivity,
        response,
        remaining=remaining,
    )


def rescored(fitter: Fitter, fit: Fit, score: Score) -> Score:
    """Return a score whose columns hold all data of a fitter; the starting point stays.

    Args:
        fitter: with the data frozen.
        fit: of these data.
        score: from an excerpt of the data, or lean. A score of all data is returned unchanged.

    """
    if len(score.sensitivity) == len(fit.residual):
        return score
    free, at = [*fit.coordinates, score.coordinate], np.append(fit.at, 0.0)
    sensitivity = fitter.column(free, at, fit.residual, len(fit.at))
    fresh = score_of(score.coordinate, sensitivity, Projection(fit))
    if score.start is None:
        return fresh
    return replace(fresh, statistic=score.statistic, estimate=score.estimate, start=score.start)


@dataclass(frozen=True)
class Pair:
    """Two candidates in one linear model.

    Attributes:
        scores: of each candidate alone.
        sizes: joint estimates, in typical sizes.
        delta_chi2: expected gain in chi-square of both together.

    """

    scores: tuple[Score, Score]
    sizes: tuple[float, float]
    delta_chi2: float


def pairs_of(scores: Sequence[Score], fit: Fit) -> list[Pair]:
    """Return pairs that explain clearly more than any pair with the best single candidate.

    Args:
        scores: of all candidates.
        fit: at which they were computed.

    """
    able = [s for s in scores if s.visible]
    if len(able) < 2:
        return []
    residual = Projection(fit).residual
    normal, gradient = np.zeros((len(able), len(able))), np.zeros(len(able))
    # block by block: a copy of all columns of a long recording would be large
    for first in range(0, len(residual), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        columns = np.stack([s.column[rows] for s in able])
        normal += columns @ columns.T
        gradient -= columns @ residual[rows]
    sizes, deltas = _jointly(normal, gradient)
    ends = np.array([s.coordinate.bounds for s in able])
    inside = (sizes >= ends[:, :1]) & (sizes <= ends[:, 1:])
    deltas = np.where(inside & inside.T, deltas, 0.0)
    best = max(range(len(able)), key=lambda i: able[i].statistic)
    least = max(float(np.max(deltas[best])), able[best].statistic) / NEARLY_ALL
    pairs = islice(_above(deltas, least), MOST_PAIRS)
    return [Pair((able[i], able[j]), (float(sizes[i, j]), float(sizes[j, i])), float(deltas[i, j]))
            for i, j in pairs]  # fmt: skip


def _jointly(normal: Array, gradient: Array) -> tuple[Array, Array]:
    """Return the estimate of each candidate in a model with each other one, and the joint gains.

    Nearly collinear pairs get zero.
    """
    power = np.diag(normal)
    determinant = np.outer(power, power) - normal**2
    independent = determinant > SMALL_PART * np.outer(power, power)
    sizes = np.where(
        independent, gradient[:, None] * power - normal * gradient, 0.0
    ) / np.where(independent, determinant, 1.0)  # fmt: skip
    parts = sizes * gradient[:, None]
    return sizes, parts + parts.T


def _above(deltas: Array, least: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs whose gain exceeds a limit, best first."""
    upper = np.triu(deltas, 1)
    for flat in np.argsort(-upper, axis=None):
        i, j = np.unravel_index(flat, upper.shape)
        if upper[i, j] <= least:
            return
        yield int(i), int(j)
