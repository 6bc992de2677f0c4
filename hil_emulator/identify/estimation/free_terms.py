"""What a law of any form would explain: what an effect in no catalogue would look like, and where.

A free term is one balance and one regressor; six hat functions of the regressor are put into the
balance along the filtered trajectory. One that explains much more than the best catalogued effect
says that the law is another one, or that the effect is unknown.
"""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array, Single
from hil_emulator.identify.prediction.free_terms.balances import Balance
from hil_emulator.identify.prediction.free_terms.free_shapes import (
    FreeShape,
    along_the_stroke,
    hats,
    shapes_along,
)
from hil_emulator.identify.prediction.free_terms.regressors import Regressors
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import side_by_side
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

ROWS_AT_ONCE = 4096
"""Rows of a term's columns that are combined at once."""


@dataclass(frozen=True)
class DiscrepancyTerm:
    """A term that a balance may lack, over one regressor, and what it explains.

    Attributes:
        balance: where the term sits.
        regressor: what it depends on.
        statistic: gain in chi-square.
        limit: what chance reaches in one of ten thousand, residuals serially correlated.
        knots: values of the regressor.
        curve: the term there, in the balance's unit.
        columns: derivative of the residual by each hat; none of a term that is not significant, but
            for the best of those that are no error of a sensor.
        uncertainty: standard deviation that each free parameter gets from a term of this strength
            and unknown shape.
        usual: what chance reaches on average.

    """

    balance: Balance
    regressor: str
    statistic: float
    limit: float
    knots: Array
    curve: Array
    columns: Array | Single
    uncertainty: Array = field(default_factory=lambda: np.zeros(0))
    usual: float = 0.0

    def lean(self) -> "DiscrepancyTerm":
        """Return the term without its columns: those of a long recording are large."""
        return replace(self, columns=np.zeros((0, 0), np.float32))

    @property
    def title(self) -> str:
        """The balance and its regressor in words."""
        return f"{self.balance.name} over {self.regressor}"

    @property
    def significant(self) -> bool:
        """Whether chance hardly explains it."""
        return self.statistic > self.limit

    @property
    def ripples(self) -> bool:
        """Whether friction that every machine has changes over this, along the stroke."""
        return along_the_stroke(self.balance, self.regressor)

    @property
    def surplus(self) -> float:
        """Gain in chi-square beyond what the term has by chance on average."""
        return self.statistic - self.usual

    @property
    def robust(self) -> float:
        """The same of as many uncorrelated residuals as these are worth."""
        return self.surplus / max(1.0, self.usual / len(self.knots))

    @property
    def excess(self) -> float:
        """Gain in chi-square beyond what chance hardly ever reaches."""
        return self.statistic - self.limit


def score_terms(
    fitter: Fitter, coordinates: Sequence[Coordinate], at: Array, project: Projection,
    seed: int = 0, only: Collection[str] | None = None, kept: int | None = None,
) -> list[DiscrepancyTerm]:  # fmt: skip
    """Return what every term explains, best first.

    Args:
        fitter: with frozen experiments.
        coordinates: what was free.
        at: where it ended.
        project: takes out what the free parameters explain.
        seed: of the random signs that give the limits.
        only: titles of those that are asked about; None for all.
        kept: terms of each balance whose columns are kept at most; None for all that are
            significant.

    """
    predictor, frozen = fitter.predictor, fitter.frozen
    point = predictor.model.memory(coordinates, at)

    def seen(one: object) -> Regressors:
        return predictor.regressors(one, predictor.innovations(one, *point, track=True)[1])

    def scored(shape: FreeShape, jobs: int = 1) -> DiscrepancyTerm:
        columns = _columns(predictor, frozen, values, shape, jobs)
        return _score(shape, columns, project, seed, fitter.correlation_length)

    values = list(side_by_side(seen, frozen, fitter.jobs))
    asked = [s for s in shapes_along(predictor.balances, values) if only is None or s.title in only]
    found: list[DiscrepancyTerm] = []
    # what the first one computes of each experiment serves all others
    first = (scored(shape, fitter.jobs) for shape in asked[:1])
    for term in chain(first, side_by_side(scored, asked[1:], fitter.jobs)):
        found = _slim([*found, term], kept) if only is None else [*found, term]
    return sorted(found, key=_short)


def _columns(
    predictor: Predictor, frozen: Sequence[object], values: Sequence[Regressors], shape: FreeShape,
    jobs: int,
) -> Single:  # fmt: skip
    """Return what each hat of a shape does to the residuals, shape (residuals, hats)."""

    def made(one: object, along: Regressors) -> Single:
        terms = hats(along[shape.regressor], shape.knots) * shape.balance.scale
        return predictor.through(one, shape.balance, terms).astype(np.float32, copy=False)

    several = list(zip(frozen, values, strict=True))
    parts = list(side_by_side(lambda both: made(*both), several, jobs))
    return np.ascontiguousarray(np.concatenate(parts, axis=1).T)


def _short(term: DiscrepancyTerm) -> float:
    """Return by how much a term falls short of what chance hardly explains."""
    return term.limit - term.statistic


def _slim(found: Sequence[DiscrepancyTerm], kept: int | None) -> list[DiscrepancyTerm]:
    """Return terms with the columns that are asked for."""
    best = min((t for t in found if not t.balance.channel), key=_short, default=None)
    asked = leading(found, len(found) if kept is None else kept)
    return [t if t is best or (t.significant and t.title in asked) else t.lean() for t in found]


def leading(terms: Sequence[DiscrepancyTerm], count: int) -> set[str]:
    """Return the titles of the terms of each balance that explain the most, so many at most."""
    seen: Counter[str] = Counter()
    found: set[str] = set()
    for term in sorted(terms, key=lambda t: -t.statistic):
        if seen[term.balance.name] < count:
            found.add(term.title)
        seen[term.balance.name] += 1
    return found


def _score(
    shape: FreeShape, columns: Single, project: Projection, seed: int, correlation_length: int
) -> DiscrepancyTerm:  # fmt: skip
    residual = project.residual
    projected, responses = project.together(columns)
    if not np.isfinite(projected).all():  # along it the model has no course
        projected[:] = 0.0
    values, vectors = np.linalg.eigh(projected.T @ projected)
    keep = values > 1e-4 * max(values[-1], 1e-30)
    basis = combined(projected, vectors[:, keep] / np.sqrt(values[keep]))
    components = basis.T @ residual
    curve = -(vectors[:, keep] / np.sqrt(values[keep])) @ components * shape.balance.scale
    statistic = float(components @ components)
    # what the term explains is no measure of chance
    usual, limit = chance(basis, residual - basis @ components, seed, 2 * correlation_length)
    strength = max(statistic - usual, 0.0) / max(float(np.sum(values)), 1e-30)
    uncertainty = np.sqrt(strength * np.sum(np.square(responses), axis=1))
    return DiscrepancyTerm(
        shape.balance, shape.regressor, statistic, limit, shape.knots, curve, columns, uncertainty,
        usual,
    )  # fmt: skip


def combined(columns: Array, weights: Array) -> Array:
    """Return columns times no more weights, in their place: a second copy would be large."""
    for first in range(0, len(columns), ROWS_AT_ONCE):
        rows = columns[first : first + ROWS_AT_ONCE]
        rows[:, : weights.shape[1]] = rows @ weights
    return columns[:, : weights.shape[1]]


def chance(basis: Array, residual: Array, seed: int, length: int) -> tuple[float, float]:
    """Return the statistic of residuals without any effect: the mean, and one in ten thousand.

    Whole blocks of the residual get random signs, which keeps their serial correlation: a wild
    bootstrap by blocks.
    """
    blocks = len(residual) // length
    rows = blocks * length
    if blocks < 4:
        return float("inf"), float("inf")
    parts = np.einsum(  # a term that moved nothing has no columns
        "blk,bl->bk", basis[:rows].reshape(blocks, length, basis.shape[1]),
        residual[:rows].reshape(blocks, length),
    )  # fmt: skip
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(400, len(parts)))
    sums = np.sum((signs @ parts) ** 2, axis=1)
    # a gamma law through mean and variance reaches further than 400 draws
    mean, variance = float(np.mean(sums)), float(np.var(sums))
    return mean, mean + 7.5 * float(np.sqrt(variance)) + 10.0
