"""Nonparametric (free) terms: laws of any shape, scored without a catalogue.

A free term is a function of one regressor in one balance, with six hat functions along the filtered
trajectory. A term that explains much more than the best effect of the catalogue shows another law
of that effect, or an unknown effect.
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
"""Rows of a term's columns that are combined at once; limits the memory."""


@dataclass(frozen=True)
class DiscrepancyTerm:
    """Score of a free term over one regressor in one balance.

    Attributes:
        balance: to which the term is added.
        regressor: of which it is a function.
        statistic: gain in chi-square.
        limit: critical value of the statistic, p = 1e-4, with serial correlation.
        knots: values of the regressor.
        curve: the term at the knots, in the balance's unit.
        columns: derivative of the residual by each hat; empty for a term that is not significant,
            except for the best one that is not a sensor error.
        uncertainty: standard deviation of each free parameter due to a term of this strength and
            unknown shape.
        null_mean: mean of the statistic by chance.

    """

    balance: Balance
    regressor: str
    statistic: float
    limit: float
    knots: Array
    curve: Array
    columns: Array | Single
    uncertainty: Array = field(default_factory=lambda: np.zeros(0))
    null_mean: float = 0.0

    def lean(self) -> "DiscrepancyTerm":
        """Return the term without its columns, which are large for long recordings."""
        return replace(self, columns=np.zeros((0, 0), np.float32))

    @property
    def title(self) -> str:
        """The balance and its regressor in words."""
        return f"{self.balance.name} over {self.regressor}"

    @property
    def significant(self) -> bool:
        """Whether the statistic exceeds its critical value."""
        return self.statistic > self.limit

    @property
    def ripples(self) -> bool:
        """Whether it is a term of the friction balance along the stroke, where ripple is usual."""
        return along_the_stroke(self.balance, self.regressor)

    @property
    def surplus(self) -> float:
        """Gain in chi-square in excess of its mean by chance."""
        return self.statistic - self.null_mean

    @property
    def robust(self) -> float:
        """Surplus for the effective number of uncorrelated residuals."""
        return self.surplus / max(1.0, self.null_mean / len(self.knots))

    @property
    def excess(self) -> float:
        """Gain in chi-square in excess of its critical value."""
        return self.statistic - self.limit


def score_terms(
    fitter: Fitter, coordinates: Sequence[Coordinate], at: Array, project: Projection,
    seed: int = 0, only: Collection[str] | None = None, kept: int | None = None,
) -> list[DiscrepancyTerm]:  # fmt: skip
    """Return the scores of the free terms, the most significant first.

    Args:
        fitter: with frozen experiments.
        coordinates: of the fit.
        at: their values.
        project: projects out the coordinates.
        seed: of the random signs for the critical values.
        only: titles of terms; None for all.
        kept: largest number of terms per balance whose columns are kept; None for all significant
            terms.

    """
    predictor, frozen = fitter.predictor, fitter.frozen
    point = predictor.model.memory(coordinates, at)

    def regressors(one: object) -> Regressors:
        return predictor.regressors(one, predictor.innovations(one, *point, track=True)[1])

    def scored(shape: FreeShape, jobs: int = 1) -> DiscrepancyTerm:
        columns = _columns(predictor, frozen, values, shape, jobs)
        return _score(shape, columns, project, seed, fitter.correlation_length)

    values = list(side_by_side(regressors, frozen, fitter.jobs))
    shapes = shapes_along(predictor.balances, values)
    chosen = [s for s in shapes if only is None or s.title in only]
    terms: list[DiscrepancyTerm] = []
    # the first shape computes data of each experiment that all others reuse
    first = (scored(shape, fitter.jobs) for shape in chosen[:1])
    for term in chain(first, side_by_side(scored, chosen[1:], fitter.jobs)):
        terms = _slim([*terms, term], kept) if only is None else [*terms, term]
    return sorted(terms, key=_shortfall)


def _columns(
    predictor: Predictor, frozen: Sequence[object], values: Sequence[Regressors], shape: FreeShape,
    jobs: int,
) -> Single:  # fmt: skip
    """Return the derivatives of the residuals by each hat of a shape, shape (residuals, hats)."""

    def of_experiment(one: object, along: Regressors) -> Single:
        terms = hats(along[shape.regressor], shape.knots) * shape.balance.scale
        return predictor.through(one, shape.balance, terms).astype(np.float32, copy=False)

    several = list(zip(frozen, values, strict=True))
    parts = list(side_by_side(lambda pair: of_experiment(*pair), several, jobs))
    return np.ascontiguousarray(np.concatenate(parts, axis=1).T)


def _shortfall(term: DiscrepancyTerm) -> float:
    """Return the critical value of a term minus its statistic."""
    return term.limit - term.statistic


def _slim(terms: Sequence[DiscrepancyTerm], kept: int | None) -> list[DiscrepancyTerm]:
    """Return the terms, with columns only where they are needed."""
    best = min((t for t in terms if not t.balance.channel), key=_shortfall, default=None)
    needed = leading(terms, len(terms) if kept is None else kept)
    return [t if t is best or (t.significant and t.title in needed) else t.lean() for t in terms]


def leading(terms: Sequence[DiscrepancyTerm], count: int) -> set[str]:
    """Return the titles of the strongest terms of each balance, at most `count` each."""
    listed: Counter[str] = Counter()
    titles: set[str] = set()
    for term in sorted(terms, key=lambda t: -t.statistic):
        if listed[term.balance.name] < count:
            titles.add(term.title)
        listed[term.balance.name] += 1
    return titles


def _score(
    shape: FreeShape, columns: Single, project: Projection, seed: int, correlation_length: int
) -> DiscrepancyTerm:  # fmt: skip
    residual = project.residual
    projected, responses = project.together(columns)
    if not np.isfinite(projected).all():  # the model diverges with this term
        projected[:] = 0.0
    values, vectors = np.linalg.eigh(projected.T @ projected)
    keep = values > 1e-4 * max(values[-1], 1e-30)
    basis = combined(projected, vectors[:, keep] / np.sqrt(values[keep]))
    components = basis.T @ residual
    curve = -(vectors[:, keep] / np.sqrt(values[keep])) @ components * shape.balance.scale
    statistic = float(components @ components)
    # the null distribution is that of the residual without the term
    without = residual - basis @ components
    null_mean, limit = null_distribution(basis, without, seed, 2 * correlation_length)
    strength = max(statistic - null_mean, 0.0) / max(float(np.sum(values)), 1e-30)
    uncertainty = np.sqrt(strength * np.sum(np.square(responses), axis=1))
    return DiscrepancyTerm(
        shape.balance, shape.regressor, statistic, limit, shape.knots, curve, columns, uncertainty,
        null_mean,
    )  # fmt: skip


def combined(columns: Array, weights: Array) -> Array:
    """Return columns @ weights, computed in place: a second copy would be large."""
    for first in range(0, len(columns), ROWS_AT_ONCE):
        rows = columns[first : first + ROWS_AT_ONCE]
        rows[:, : weights.shape[1]] = rows @ weights
    return columns[:, : weights.shape[1]]


def null_distribution(basis: Array, residual: Array, seed: int, length: int) -> tuple[float, float]:
    """Return the mean and the critical value (p = 1e-4) of a statistic without any effect.

    By a block wild bootstrap: random signs of whole blocks preserve the serial correlation.
    """
    blocks = len(residual) // length
    rows = blocks * length
    if blocks < 4:
        return float("inf"), float("inf")
    parts = np.einsum(  # the basis of a term without influence has no columns
        "blk,bl->bk", basis[:rows].reshape(blocks, length, basis.shape[1]),
        residual[:rows].reshape(blocks, length),
    )  # fmt: skip
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(400, len(parts)))
    sums = np.sum((signs @ parts) ** 2, axis=1)
    # extrapolates beyond 400 draws: at most a gamma distribution of this mean and variance
    mean, variance = float(np.mean(sums)), float(np.var(sums))
    return mean, mean + 7.5 * float(np.sqrt(variance)) + 10.0
