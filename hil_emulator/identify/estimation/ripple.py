"""Friction that ripples along the stroke, as that of every machine does: taken out of estimates.

Seals, bore and rod are nowhere the same: friction changes from place to place by some percent, and
a law of friction takes a part of that for itself. So at the end the ripple is integrated out: at
each place friction is larger or smaller by a share of its own, all of one variance, which the data
tell. What is estimated beside it is generalised least squares (Aitken 1935, Proceedings of the
Royal Society of Edinburgh 55, 42-48).
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

SHARES = (1e-4, 1.0)
"""Standard deviations of the ripple over the friction among which the likeliest is looked for: from
what no data show to friction that comes and goes."""

PARTS = (1.0, 0.5, 0.25)
"""Parts of the way to the estimate beside the ripple that are tried until one is likelier."""


class Along(NamedTuple):
    """An experiment beside the likeliest ripple.

    Attributes:
        name: of the experiment.
        shown: what each coordinate does that nothing else can, shape (coordinates, residuals).
        left: what the linear model leaves with the likeliest ripple, shape (residuals,).

    """

    name: str
    shown: Single
    left: Array


class Ripple:
    """A finished model with friction that ripples beside it.

    Args:
        fitter: with the training data, frozen where the fit ended.
        begun: the model.

    Attributes:
        share: standard deviation of the ripple over the friction; 0 where there is none.
        fit: the model where it is likeliest with the ripple integrated out, which makes its
            coordinates less certain.
        beyond: how far its coordinates are from where the linear model has them: zero, where a
            whole step leads there and meets no end of a range.

    """

    def __init__(self, fitter: Fitter, begun: Fit) -> None:
        self._fitter, self._begun = fitter, begun
        self._training = Linearised(fitter.batch, begun.residual, begun.jacobian)
        self._knots = _places(fitter)
        count = len(self._knots)
        self._sums = Sums.nothing(count, len(begun.at))
        for columns, jacobian, residual, _ in self._rows(self._training):
            self._sums.add(columns, jacobian, residual, fitter.jobs)
        self._noise = self._sums.power / self._sums.rows
        nothing = Sums.nothing(count, len(begun.at))
        evidence = LogEvidence(begun, self._sums, nothing, self._noise)
        self.share = _likeliest(evidence, count)
        self._ripple, uncertain = evidence.terms(self.share * np.eye(count))
        self._shift = evidence.shift(self._ripple)
        self._covariance = evidence.covariance(uncertain)
        self.fit = self._settled(self._covariance - evidence.covariance())
        self.beyond = self.fit.at - begun.at - self._shift

    def along(self, names: Sequence[str], seen: Linearised | None = None) -> Iterator[Along]:
        """Yield what is left of each experiment, and what some coordinates do there.

        Args:
            names: of the coordinates.
            seen: experiments that took no part in the fit; None for those that did.

        """
        own = [[c.name for c in self._begun.coordinates].index(name) for name in names]
        ways = self._covariance[:, own] / np.diag(self._covariance)[own]
        hidden = self._against(self._sums.mixed @ ways)
        rippling = np.column_stack([self._ripple, hidden]).T.astype(np.float32)
        parts: list[tuple[Single, Array]] = []
        one = self._training if seen is None else seen
        experiments = iter(f.experiment.name for f in one.batch.frozen if isinstance(f, Frozen))
        for columns, jacobian, residual, last in self._rows(one):
            ripple, taken = np.split(rippling @ columns, [1])
            shown = (ways.T @ jacobian.T - taken).astype(np.float32)
            parts.append((shown, residual + jacobian @ self._shift + ripple[0]))
            if last:
                shown, left = (np.concatenate(p, axis=-1) for p in zip(*parts, strict=True))
                yield Along(next(experiments), shown, left)
                parts.clear()

    def _settled(self, further: Array) -> Fit:
        """Return the fit where it is likeliest, as far as a linear step leads there."""
        begun = replace(self._begun, further=further)
        low, high = np.array([c.bounds for c in begun.coordinates]).reshape(-1, 2).T
        before = self._loss(begun.at, begun.residual, self._sums.onto)
        for part in PARTS if self.share else ():
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
        """Return the sum of squares beside the likeliest ripple, priors and its own included."""
        left = float(residual @ residual - onto @ self._against(onto)) / self._noise
        return left + self._fitter.loss(self._begun.coordinates, at, np.zeros(0))

    def _against(self, onto: Array) -> Array:
        """Return the likeliest ripple against what has these products with its columns."""
        ratio = self.share**2 / self._noise
        return np.asarray(
            ratio * np.linalg.solve(np.eye(len(onto)) + ratio * self._sums.shapes, onto)
        )

    def _rows(self, seen: Linearised) -> Iterator[tuple[Single, Array, Array, bool]]:
        """Yield what the ripple at each place does, Jacobian and residual, piece by piece.

        The last of the four tells whether an experiment ends there.
        """
        predictor, begin = self._fitter.predictor, 0
        point = predictor.model.memory(self._begun.coordinates, self._begun.at)

        def regressors(frozen: Frozen) -> Regressors:
            path = predictor.innovations(frozen, *point, track=True)[1]
            return predictor.regressors(frozen, path)

        followed = [f for f in seen.batch.frozen if isinstance(f, Frozen)]
        found = by_turns(regressors, followed, self._fitter.jobs)
        for frozen, along in zip(followed, found, strict=True):
            for piece in pieces(frozen):
                here = slice(piece.begin, piece.end)
                terms = hats(along["position"][here], self._knots)
                columns = self._columns(piece.frozen, terms * along["friction"][here, None])
                columns = columns[:, piece.repeated * len(frozen.channels) :]
                kept = slice(begin, begin + columns.shape[1])
                begin = kept.stop
                yield columns, seen.jacobian[kept], seen.residual[kept], piece.last

    def _columns(self, frozen: Frozen, terms: Array) -> Single:
        """Return what terms in the balance of the piston do to the residuals."""

        def made(first: int) -> Single:
            some = terms[:, first : first + TOGETHER]
            changes = self._fitter.predictor.through(frozen, PISTON, some)
            return changes.astype(np.float32, copy=False)

        groups = range(0, terms.shape[1], TOGETHER)
        return np.concatenate(list(side_by_side(made, groups, self._fitter.jobs)))


def ripples(fitter: Fitter, fit: Fit) -> bool:
    """Tell whether data show places of the stroke: noise that is estimated holds ripple already."""
    if fit.effective is not None or PISTON not in fitter.predictor.balances:
        return False
    if not fit.residual.any():  # nothing counts of so short a record
        return False
    return all(isinstance(f, Frozen) for f in fitter.frozen) and len(_places(fitter)) > 0


def _places(fitter: Fitter) -> Array:
    """Return places along the way that the rod goes; none where nobody knows it."""
    measured = np.concatenate([e.matrix(("position",))[:, 0] for e in fitter.experiments])
    known = measured[np.isfinite(measured)]
    if not len(known) or np.ptp(known) == 0.0:
        return np.zeros(0)
    return np.linspace(known.min(), known.max(), PLACES)


def _likeliest(evidence: LogEvidence, count: int) -> float:
    """Return the standard deviation of the ripple that is likeliest, 0 if that is none."""
    rows = np.arange(count)

    def against(exponent: float) -> float:
        told, free = evidence(rows, np.exp(exponent) * np.eye(count))
        return -told - free

    found = minimize_scalar(against, bounds=np.log(SHARES), method="bounded")
    return float(np.exp(found.x)) if found.fun < against(np.log(SHARES[0])) else 0.0
