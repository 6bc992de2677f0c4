"""Normal equations of free shapes and coordinates, summed over all rows of the recordings.

The columns of about two hundred hats would not fit into memory. They are computed for one
experiment at a time, and recomputed when they are needed again.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TypeVar

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, Linearised, prior_rows
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.measured.experiment import Array, Single
from hil_emulator.identify.prediction.free_terms.free_shapes import FreeShape, hats, shapes_along
from hil_emulator.identify.prediction.free_terms.regressors import Regressors
from hil_emulator.identify.prediction.parallel.pool import Batch, by_turns, side_by_side

R = TypeVar("R")

MOST_ROWS = 300_000
"""Largest number of rows per experiment: one minute of five channels at 1 kHz is enough."""

TOGETHER = 24
"""Hats that pass the filter at once, for vector instructions of the processor."""

ROWS_AT_ONCE = 4096
"""Rows of the hats' columns in double precision at once; limits the memory."""

RIDGE = 0.01
"""Ridge penalty of a joint fit of all hats, over the information of each hat (assumed)."""


@dataclass
class Sums:
    """Products of the columns X of hats, J of coordinates, and of a residual r, over all rows.

    Attributes:
        shapes: X X', shape (hats, hats).
        mixed: X J, shape (hats, coordinates).
        onto: X r.
        normal: J'J.
        slope: J'r.
        power: r'r.
        rows: number of rows.

    """

    shapes: Array
    mixed: Array
    onto: Array
    normal: Array
    slope: Array
    power: float = 0.0
    rows: int = 0

    @classmethod
    def zeros(cls, hats: int, coordinates: int) -> "Sums":
        """Return the sums over zero rows."""
        return cls(np.zeros((hats, hats)), np.zeros((hats, coordinates)), np.zeros(hats),
                   np.zeros((coordinates, coordinates)), np.zeros(coordinates))  # fmt: skip

    @classmethod
    def over(cls, columns: Single, jacobian: Array, residual: Array) -> "Sums":
        """Return the sums over rows.

        Args:
            columns: of the hats, shape (hats, rows), of single precision.
            jacobian: shape (rows, coordinates).
            residual: shape (rows,).

        """
        some = columns.astype(np.float64)
        shapes = (columns @ columns.T).astype(np.float64)
        return cls(shapes, some @ jacobian, some @ residual, jacobian.T @ jacobian,
                   jacobian.T @ residual, float(residual @ residual), len(residual))  # fmt: skip

    def add(self, columns: Single, jacobian: Array, residual: Array, jobs: int = 1) -> None:
        """Add rows, on several threads; arguments as for `over`."""
        for part in by_rows(Sums.over, (columns, jacobian, residual), ROWS_AT_ONCE, jobs):
            self.shapes += part.shapes
            self.mixed += part.mixed
            self.onto += part.onto
            self.normal += part.normal
            self.slope += part.slope
            self.power += part.power
            self.rows += part.rows


class ShapeSums:
    """Free shapes of a model, and their sums.

    Args:
        fitter: with the training data, frozen at the fit.
        fit: of the model without the shapes.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self._values = list(self._regressors(fitter.batch))
        self.shapes = list(shapes_along(fitter.predictor.balances, self._values))

    def training(self) -> Sums:
        """Return the sums over the training data."""
        rows = self._rows(self._fitter.batch, self._values, self._fit.residual, self._fit.jacobian)
        return self._sums(rows)

    def held_out(self, held: Linearised | None) -> Sums:
        """Return the sums over held-out data with the same columns; zero without any."""
        if held is None:
            return self._sums([])
        values = list(self._regressors(held.batch))
        return self._sums(self._rows(held.batch, values, held.residual, held.jacobian))

    def inflations(self, training: Sums) -> Array:
        """Return the factor of serial correlation on the variance of each shape (median hat).

        The correlation is that of the residual of a joint ridge fit of all shapes and coordinates,
        so that unexplained terms do not count as noise.
        """
        fit = self._fit
        weights = prior_rows(fit.coordinates)
        across = training.mixed @ inverse(training.normal + np.diag(weights**2))
        information = training.shapes - across @ training.mixed.T
        gradient = training.onto - across @ (training.slope + weights**2 * fit.at)
        terms = -inverse(information, RIDGE) @ gradient
        response = across.T @ terms
        length = max(1, self._fitter.correlation_length)

        def block_sums(columns: Single, jacobian: Array, residual: Array) -> tuple[Array, Array]:
            some = columns.astype(np.float64)
            rest = residual - jacobian @ response + terms @ some
            some -= across @ jacobian.T
            blocks = np.add.reduceat(some * rest, np.arange(0, len(rest), length), axis=1)
            return np.sum(blocks**2, axis=1), np.sum(some**2, axis=1)

        sums, powers = np.zeros(len(terms)), np.zeros(len(terms))
        whole_blocks = length * math.ceil(ROWS_AT_ONCE / length)
        for rows in self._rows(self._fitter.batch, self._values, fit.residual, fit.jacobian):
            for of_blocks, power in by_rows(block_sums, rows, whole_blocks, self._fitter.jobs):
                sums += of_blocks
                powers += power
        widened = np.maximum(sums / np.maximum(powers, 1e-12), 1.0)
        ends = np.cumsum([len(s.knots) for s in self.shapes])
        return np.array([np.median(part) for part in np.split(widened, ends[:-1])])

    def _sums(self, rows: Iterable[tuple[Single, Array, Array]]) -> Sums:
        sums = Sums.zeros(self._hats, len(self._fit.at))
        for columns, jacobian, residual in rows:
            sums.add(columns, jacobian, residual, self._fitter.jobs)
        return sums

    @property
    def _hats(self) -> int:
        """Number of hats of all shapes."""
        return sum(len(s.knots) for s in self.shapes)

    def _regressors(self, batch: Batch) -> Iterator[Regressors]:
        predictor = self._fitter.predictor
        point = predictor.model.memory(self._fit.coordinates, self._fit.at)

        def regressors(frozen: object) -> Regressors:
            path = predictor.innovations(frozen, *point, track=True)[1]
            return predictor.regressors(frozen, path)

        yield from side_by_side(regressors, batch.frozen, self._fitter.jobs)

    def _rows(
        self, batch: Batch, values: Sequence[Regressors], residual: Array, jacobian: Array
    ) -> Iterator[tuple[Single, Array, Array]]:
        """Yield columns, Jacobian and residual of each experiment.

        The columns of all experiments share one buffer.
        """
        begin, jobs = 0, self._fitter.jobs
        first, *rest = self._groups()
        buffer = np.zeros((0, 0), np.float32)
        experiments = list(zip(batch.frozen, values, strict=True))
        # the first group computes data of an experiment that all other groups reuse
        firsts = by_turns(lambda one: self._columns(*one, first), experiments, jobs)
        for one, of_first in zip(experiments, firsts, strict=True):
            columns_of = partial(self._columns, *one)
            rows, at = of_first.shape[1], 0
            if buffer.shape[1] < min(rows, MOST_ROWS):
                buffer = np.empty((self._hats, min(rows, MOST_ROWS)), np.float32)
            columns = buffer[:, :rows]
            for part in chain([of_first], side_by_side(columns_of, rest, jobs)):
                columns[at : at + len(part)] = part[:, :MOST_ROWS]
                at += len(part)
            kept = slice(begin, begin + columns.shape[1])
            begin += rows
            yield columns, jacobian[kept], residual[kept]

    def _groups(self) -> Iterator[list[FreeShape]]:
        """Yield groups of successive shapes of one balance, with at most `TOGETHER` hats each."""
        group: list[FreeShape] = []
        for shape in self.shapes:
            count = sum(len(s.knots) for s in (*group, shape))
            if group and (shape.balance is not group[0].balance or count > TOGETHER):
                yield group
                group = []
            group.append(shape)
        if group:
            yield group

    def _columns(self, frozen: object, along: Regressors, group: Sequence[FreeShape]) -> Single:
        """Return the derivatives of an experiment's residual by hats of a balance: (hats, rows)."""
        balance = group[0].balance
        terms = np.concatenate([hats(along[s.regressor], s.knots) for s in group], axis=1)
        columns = self._fitter.predictor.through(frozen, balance, terms * balance.scale)
        return columns.astype(np.float32, copy=False)


def by_rows(
    work: Callable[[Single, Array, Array], R], data: tuple[Single, Array, Array], at_once: int,
    jobs: int,
) -> Iterator[R]:  # fmt: skip
    """Yield the results of a function for blocks of rows, in their order.

    Args:
        work: takes columns, Jacobian and residual, all but the columns in double precision.
        data: columns of hats, shape (hats, rows), Jacobian and residual.
        at_once: rows per block.
        jobs: threads.

    """
    columns, jacobian, residual = data

    def some(first: int) -> R:
        rows = slice(first, first + at_once)
        return work(columns[:, rows], jacobian[rows].astype(np.float64), residual[rows])

    yield from side_by_side(some, range(0, len(residual), at_once), jobs)


def inverse(matrix: Array, ridge: float = 0.0) -> Array:
    """Return the pseudoinverse of a covariance or information, without nearly singular directions.

    Args:
        matrix: symmetric, positive semidefinite.
        ridge: added to the diagonal of the scaled matrix.

    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-12))
    scaled = matrix * np.outer(scale, scale) + ridge * np.eye(len(matrix))
    return np.outer(scale, scale) * np.linalg.pinv(scaled, rcond=1e-10, hermitian=True)
