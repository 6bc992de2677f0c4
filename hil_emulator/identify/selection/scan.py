"""Score every candidate and every pair, with what ordinary parameters could explain taken out."""

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

NO_EFFECT = 1e-9
"""Gain in chi-square at its typical size up to which an effect does nothing: rounding."""

LEAST_COARSE_PART = 0.1
"""Part of what the best candidate explains below which a sensor is looked at roughly (assumed)."""

ROWS_AT_ONCE = 4096
"""Rows of the candidates' columns whose products are added up at once."""

MOST_PAIRS = 4
"""Most pairs that are tried in the model."""


@dataclass(frozen=True)
class Score:
    """What the linearised data say about one candidate.

    Attributes:
        coordinate: the candidate.
        statistic: gain in chi-square that the linear model expects.
        estimate: its linear estimate, in typical sizes.
        information: squared norm of its projected column: the gain of the effect at typical size.
        column: derivative of the residual, ordinary parameters projected out; empty once forgotten.
        sensitivity: the same, nothing projected out; empty in a lean score.
        response: change of the ordinary parameters with the candidate.
        start: where a refit begins; None for where the linear model puts it.
        remaining: part of the variance that the candidate leaves, where the noise is estimated with
            it in there: a gap that it closes does not hide it.

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
        """Whether these data would show the effect at its typical size."""
        return self.information > DISTINGUISHABLE * self.remaining

    @property
    def flat(self) -> bool:
        """Whether a limit that is far away does nothing: it has to come nearer to be seen."""
        return self.coordinate.inverse and self.information <= NO_EFFECT

    def lean(self) -> "Score":
        """Return the score without its sensitivity: long recordings would fill the memory."""
        return replace(self, sensitivity=np.zeros(0))


def size_penalty(size: float) -> float:
    """Return how much less probable a size is than none, as a chi-square: -2 log p(size)/p(0).

    Of its size nothing is known but what is typical: a Cauchy law of that width, whose tails hold
    what is ten or a hundred times as large, if the data say so plainly (Gelman et al. 2008, Annals
    of Applied Statistics 2, 1360-1383).

    Args:
        size: in typical sizes.

    """
    return 2.0 * math.log1p(size * size)


def scan(fitter: Fitter, fit: Fit, candidates: Sequence[Coordinate]) -> list[Score]:
    """Return the candidates' scores, best first.

    Sensors are first looked at roughly. What explains next to nothing of what the best does is no
    likely candidate, and cannot be mistaken for one; the others are predicted.
    """
    project = Projection(fit)
    at, last = np.append(fit.at, 0.0), len(fit.at)

    def scored(some: Sequence[Coordinate], roughly: bool) -> dict[str, Score]:
        wanted = [Derivative([*fit.coordinates, c], at, last) for c in some]
        columns = fitter.columns(wanted, fit.residual, roughly)
        return {c.name: score_of(c, column.astype(np.float32), project)
                for c, column in zip(some, columns, strict=True)}  # fmt: skip

    scores = scored(candidates, roughly=True)
    least = max((LEAST_COARSE_PART * s.statistic for s in scores.values()), default=0.0)
    likely = [c for c in candidates if c.channel and scores[c.name].statistic > least]
    scores |= scored(likely, roughly=False)
    return sorted(scores.values(), key=lambda s: -s.statistic)


def score_of(candidate: Coordinate, sensitivity: Array, project: Projection) -> Score:
    """Return the score of a candidate by its sensitivity, or by a secant."""
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
    """Return a score with the columns of other data, for the same start.

    Args:
        fitter: with those data frozen.
        fit: as it is seen there.
        score: of an excerpt of them, or lean; of all of them it is returned as it is.

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
    """Two candidates, and what the linear model expects of both.

    Attributes:
        scores: of each by itself.
        sizes: of each beside the other, in typical sizes.
        delta_chi2: in chi-square, of both.

    """

    scores: tuple[Score, Score]
    sizes: tuple[float, float]
    delta_chi2: float


def pairs_of(scores: Sequence[Score], fit: Fit) -> list[Pair]:
    """Return pairs that explain clearly more than the best candidate with any partner.

    Args:
        scores: of all candidates.
        fit: where they were taken.

    """
    able = [s for s in scores if s.visible]
    if len(able) < 2:
        return []
    residual = Projection(fit).residual
    normal, gradient = np.zeros((len(able), len(able))), np.zeros(len(able))
    # some rows at a time: all columns of a long recording once more would be large
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
    found = _above(deltas, least)
    return [Pair((able[i], able[j]), (float(sizes[i, j]), float(sizes[j, i])), float(deltas[i, j]))
            for i, j in islice(found, MOST_PAIRS)]  # fmt: skip


def _jointly(normal: Array, gradient: Array) -> tuple[Array, Array]:
    """Return the size of each candidate beside each other one, and what both gain."""
    power = np.diag(normal)
    room = np.outer(power, power) - normal**2
    apart = room > SMALL_PART * np.outer(power, power)
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
