"""Friction ripple along the stroke: a random effect, integrated out of the final estimates.

The friction of every machine varies along the stroke by some percent, which biases the estimates of
a friction law. At each place the friction gets a random factor; the factors have one common
variance, which maximises the likelihood. The other estimates are then generalised least squares
(Aitken 1935, Proceedings of the Royal Society of Edinburgh 55, 42-48).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from hil_emulator.identify.estimation.clusters import PLACES
from hil_emulator.identify.estimation.fit import Fit, Linearised
from hil_emulator.identify.estimation.log_evidence import LogEvidence
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.shape_sums import TOGETHER, Sums
from hil_emulator.identify.measured.experiment import Array, Single
from hil_emulator.identify.prediction.free_terms.balances import PISTON
from hil_emulator.identify.prediction.free_terms.free_shapes import hats
from hil_emulator.identify.prediction.free_terms.regressors import Regressors
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.windows import pieces
from hil_emulator.identify.prediction.parallel.pool import by_turns, side_by_side

RATIOS = (1e-4, 1.0)
"""Range of the ripple's standard deviation over the friction: from invisible to 100 %."""

PARTS = (1.0, 0.5, 0.25)
"""Fractions of the step to the new estimate that are tried until the likelihood increases."""


class Profiled(NamedTuple):
    """An experiment with the most likely ripple removed.

    Attributes:
        name: of the experiment.
        columns: sensitivity to each coordinate with all others and the ripple projected out, shape
            (coordinates, residuals).
        residual: of the linear model with the most likely ripple, shape (residuals,).

    """

    name: str
    columns: Single
    residual: Array


class Ripple:
    """A final model with friction ripple.

    Args:
        fitter: with the training data, frozen at the fit.
        begun: fit without ripple.

    Attributes:
        ratio: standard deviation of the ripple over the friction; 0 without ripple.
        fit: maximum of the likelihood with the ripple integrated out, which increases the
            coordinates' covariance.
        nonlinear_shift: difference of its coordinates from those of the linear model; zero unless
            the step was shortened or a bound was reached.

    """

    def __init__(self, fitter: Fitter, begun: Fit) -> None:
        self._fitter, self._begun = fitter, begun
        self._training = Linearised(fitter.batch, begun.residual, begun.jacobian)
        self._knots = _places(fitter)
        count = len(self._knots)
        self._sums = Sums.zeros(count, len(begun.at))
        for columns, jacobian, residual, _ in self._rows(self._training):
            self._sums.add(columns, jacobian, residual, fitter.jobs)
        self._noise = self._sums.power / self._sums.rows
        no_data = Sums.zeros(count, len(begun.at))
        evidence = LogEvidence(begun, self._sums, no_data, self._noise)
        self.ratio = _most_likely_ratio(evidence, count)
        self._ripple, ripple_covariance = evidence.terms(self.ratio * np.eye(count))
        self._shift = evidence.shift(self._ripple)
        self._covariance = evidence.covariance(ripple_covariance)
        self.fit = self._improved(self._covariance - evidence.covariance())
        self.nonlinear_shift = self.fit.at - begun.at - self._shift

    def profiled(self, names: Sequence[str], held: Linearised | None = None) -> Iterator[Profiled]:
        """Yield each experiment with the most likely ripple removed.

        Args:
            names: of the coordinates whose columns are computed.
            held: held-out experiments; None for the training data.

        """
        chosen = [[c.name for c in self._begun.coordinates].index(name) for name in names]
        responses = self._covariance[:, chosen] / np.diag(self._covariance)[chosen]
        absorbed = self._fitted_ripple(self._sums.mixed @ responses)
        weights = np.column_stack([self._ripple, absorbed]).T.astype(np.float32)
        parts: list[tuple[Single, Array]] = []
        data = self._training if held is None else held
        experiments = iter(f.experiment.name for f in data.batch.frozen if isinstance(f, Frozen))
        for columns, jacobian, residual, last in self._rows(data):
            ripple, by_ripple = np.split(weights @ columns, [1])
            projected = (responses.T @ jacobian.T - by_ripple).astype(np.float32)
            parts.append((projected, residual + jacobian @ self._shift + ripple[0]))
            if last:
                projected, rest = (np.concatenate(p, axis=-1) for p in zip(*parts, strict=True))
                yield Profiled(next(experiments), projected, rest)
                parts.clear()

    def _improved(self, further: Array) -> Fit:
        """Return the fit after a step to the linear optimum, shortened until it is better."""
        begun = replace(self._begun, further=further)
        low, high = np.array([c.bounds for c in begun.coordinates]).reshape(-1, 2).T
        before = self._loss(begun.at, begun.residual, self._sums.onto)
        for part in PARTS if self.ratio else ():
            at = np.clip(begun.at + part * self._shift, low, high)
            residual = self._fitter.residual(begun.coordinates, at)
            if self._loss(at, residual, self._onto(residual)) < before:
                chi2 = self._fitter.loss(begun.coordinates, at, residual)
                return replace(begun, at=at, residual=residual, chi2=chi2)
        return begun

    def _onto(self, residual: Array) -> Array:
        """Return the products of the ripple's columns with a residual of the training data."""
        rows = self._rows(replace(self._training, residual=residual))
        products = (columns @ some.astype(np.float32) for columns, _, some, _ in rows)
        return np.asarray(np.sum(list(products), axis=0, dtype=np.float64))

    def _loss(self, at: Array, residual: Array, onto: Array) -> float:
        """Return chi-square with the most likely ripple, priors of both included."""
        chi2 = float(residual @ residual - onto @ self._fitted_ripple(onto)) / self._noise
        return chi2 + self._fitter.loss(self._begun.coordinates, at, np.zeros(0))

    def _fitted_ripple(self, onto: Array) -> Array:
        """Return the ripple fitted to a vector, given the products of its columns with it."""
        ratio = self.ratio**2 / self._noise
        return np.asarray(
            ratio * np.linalg.solve(np.eye(len(onto)) + ratio * self._sums.shapes, onto)
        )

    def _rows(self, data: Linearised) -> Iterator[tuple[Single, Array, Array, bool]]:
        """Yield columns of the ripple, Jacobian and residual, piece by piece.

        The fourth item is whether the piece is the last one of an experiment.
        """
        predictor, begin = self._fitter.predictor, 0
        point = predictor.model.memory(self._begun.coordinates, self._begun.at)

        def regressors(frozen: Frozen) -> Regressors:
            path = predictor.innovations(frozen, *point, track=True)[1]
            return predictor.regressors(frozen, path)

        experiments = [f for f in data.batch.frozen if isinstance(f, Frozen)]
        values = by_turns(regressors, experiments, self._fitter.jobs)
        for frozen, along in zip(experiments, values, strict=True):
            for piece in pieces(frozen):
                here = slice(piece.begin, piece.end)
                terms = hats(along["position"][here], self._knots)
                columns = self._columns(piece.frozen, terms * along["friction"][here, None])
                columns = columns[:, piece.repeated * len(frozen.channels) :]
                kept = slice(begin, begin + columns.shape[1])
                begin = kept.stop
                yield columns, data.jacobian[kept], data.residual[kept], piece.last

    def _columns(self, frozen: Frozen, terms: Array) -> Single:
        """Return the derivatives of the residuals by terms in the balance of the piston."""

        def group_columns(first: int) -> Single:
            some = terms[:, first : first + TOGETHER]
            changes = self._fitter.predictor.through(frozen, PISTON, some)
            return changes.astype(np.float32, copy=False)

        groups = range(0, terms.shape[1], TOGETHER)
        return np.concatenate(list(side_by_side(group_columns, groups, self._fitter.jobs)))


def ripple_applies(fitter: Fitter, fit: Fit) -> bool:
    """Return whether friction ripple can be estimated: position and noise are known.

    Noise that is estimated from the residual includes the ripple already.
    """
    if fit.effective is not None or PISTON not in fitter.predictor.balances:
        return False
    if not fit.residual.any():  # all samples of a very short record are excluded
        return False
    return all(isinstance(f, Frozen) for f in fitter.frozen) and len(_places(fitter)) > 0


def _places(fitter: Fitter) -> Array:
    """Return places along the travelled stroke; empty if the position is unknown or constant."""
    measured = np.concatenate([e.matrix(("position",))[:, 0] for e in fitter.experiments])
    finite = measured[np.isfinite(measured)]
    if not len(finite) or np.ptp(finite) == 0.0:
        return np.zeros(0)
    return np.linspace(finite.min(), finite.max(), PLACES)


def _most_likely_ratio(evidence: LogEvidence, count: int) -> float:
    """Return the ripple's standard deviation over the friction that maximises the evidence."""
    rows = np.arange(count)

    def negative(exponent: float) -> float:
        data, occam = evidence(rows, np.exp(exponent) * np.eye(count))
        return -data - occam

    optimum = minimize_scalar(negative, bounds=np.log(RATIOS), method="bounded")
    return float(np.exp(optimum.x)) if optimum.fun < negative(np.log(RATIOS[0])) else 0.0
