"""What free shapes and coordinates do to residuals, in sums over all rows of a recording.

The columns of some two hundred hats would fill the memory: they are made for one experiment at a
time, and again where they are needed again.
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
"""Rows of one experiment that take part: a minute of five channels at 1 kHz shows a law's form."""

TOGETHER = 24
"""Hats that are carried through a filter at once: a processor multiplies several as fast as one."""

ROWS_AT_ONCE = 4096
"""Rows of the hats' columns that are of double precision at once."""

RIDGE = 0.01
"""Part of its information by which every hat is held where all are fitted at once (assumed)."""


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
        rows: how many.

    """

    shapes: Array
    mixed: Array
    onto: Array
    normal: Array
    slope: Array
    power: float = 0.0
    rows: int = 0

    @classmethod
    def nothing(cls, hats: int, coordinates: int) -> "Sums":
        """Return the sums over no row."""
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
        """Add rows, some of them on each thread; arguments as of `over`."""
        for part in by_rows(Sums.over, (columns, jacobian, residual), ROWS_AT_ONCE, jobs):
            self.shapes += part.shapes
            self.mixed += part.mixed
            self.onto += part.onto
            self.normal += part.normal
            self.slope += part.slope
            self.power += part.power
            self.rows += part.rows


class ShapeSums:
    """Free shapes beside a fit, and their sums.

    Args:
        fitter: with the training data, frozen where the fit ended.
        fit: what is beside them.

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
        """Return the sums over other data, of as many columns."""
        if held is None:
            return self._sums([])
        values = list(self._regressors(held.batch))
        return self._sums(self._rows(held.batch, values, held.residual, held.jacobian))

    def inflations(self, training: Sums) -> Array:
        """Return by how much serial correlation widens variances, of each shape the median hat.

        What any shape or coordinate could explain is no noise: of all of them at once, what they
        leave is looked at along each hat.
        """
        fit = self._fit
        weights = prior_rows(fit.coordinates)
        across = training.mixed @ inverse(training.normal + np.diag(weights**2))
        information = training.shapes - across @ training.mixed.T
        gradient = training.onto - across @ (training.slope + weights**2 * fit.at)
        terms = -inverse(information, RIDGE) @ gradient
        taken = across.T @ terms
        length = max(1, self._fitter.correlation_length)

        def along(columns: Single, jacobian: Array, residual: Array) -> tuple[Array, Array]:
            some = columns.astype(np.float64)
            left = residual - jacobian @ taken + terms @ some
            some -= across @ jacobian.T
            blocks = np.add.reduceat(some * left, np.arange(0, len(left), length), axis=1)
            return np.sum(blocks**2, axis=1), np.sum(some**2, axis=1)

        sums, powers = np.zeros(len(terms)), np.zeros(len(terms))
        whole_blocks = length * math.ceil(ROWS_AT_ONCE / length)
        for seen in self._rows(self._fitter.batch, self._values, fit.residual, fit.jacobian):
            for of_blocks, power in by_rows(along, seen, whole_blocks, self._fitter.jobs):
                sums += of_blocks
                powers += power
        widened = np.maximum(sums / np.maximum(powers, 1e-12), 1.0)
        ends = np.cumsum([len(s.knots) for s in self.shapes])
        return np.array([np.median(part) for part in np.split(widened, ends[:-1])])

    def _sums(self, rows: Iterable[tuple[Single, Array, Array]]) -> Sums:
        sums = Sums.nothing(self._hats, len(self._fit.at))
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

        def seen(frozen: object) -> Regressors:
            path = predictor.innovations(frozen, *point, track=True)[1]
            return predictor.regressors(frozen, path)

        yield from side_by_side(seen, batch.frozen, self._fitter.jobs)

    def _rows(
        self, batch: Batch, values: Sequence[Regressors], residual: Array, jacobian: Array
    ) -> Iterator[tuple[Single, Array, Array]]:
        """Yield columns, Jacobian and residual of each experiment; the next take the same room."""
        begin, jobs = 0, self._fitter.jobs
        first, *rest = self._groups()
        room = np.zeros((0, 0), np.float32)
        experiments = list(zip(batch.frozen, values, strict=True))
        # what the first ones compute of an experiment serves all others
        firsts = by_turns(lambda one: self._columns(*one, first), experiments, jobs)
        for one, begun in zip(experiments, firsts, strict=True):
            made = partial(self._columns, *one)
            rows, at = begun.shape[1], 0
            if room.shape[1] < min(rows, MOST_ROWS):
                room = np.empty((self._hats, min(rows, MOST_ROWS)), np.float32)
            columns = room[:, :rows]
            for part in chain([begun], side_by_side(made, rest, jobs)):
                columns[at : at + len(part)] = part[:, :MOST_ROWS]
                at += len(part)
            kept = slice(begin, begin + columns.shape[1])
            begin += rows
            yield columns, jacobian[kept], residual[kept]

    def _groups(self) -> Iterator[list[FreeShape]]:
        """Yield the shapes in their order, those of one balance together as far as hats allow."""
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
        """Return what each hat of shapes of one balance does to one experiment: (hats, rows)."""
        balance = group[0].balance
        terms = np.concatenate([hats(along[s.regressor], s.knots) for s in group], axis=1)
        made = self._fitter.predictor.through(frozen, balance, terms * balance.scale)
        return made.astype(np.float32, copy=False)


def by_rows(
    work: Callable[[Single, Array, Array], R], seen: tuple[Single, Array, Array], at_once: int,
    jobs: int,
) -> Iterator[R]:  # fmt: skip
    """Yield the work on so many rows at once, in their order.

    Args:
        work: takes columns, Jacobian and residual, all but the columns of double precision.
        seen: columns of hats, shape (hats, rows), Jacobian and residual.
        at_once: most rows.
        jobs: threads.

    """
    columns, jacobian, residual = seen

    def some(first: int) -> R:
        rows = slice(first, first + at_once)
        return work(columns[:, rows], jacobian[rows].astype(np.float64), residual[rows])

    yield from side_by_side(some, range(0, len(residual), at_once), jobs)


def inverse(matrix: Array, ridge: float = 0.0) -> Array:
    """Return the inverse of a covariance or of an information, without what it hardly tells."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-12))
    scaled = matrix * np.outer(scale, scale) + ridge * np.eye(len(matrix))
    return np.outer(scale, scale) * np.linalg.pinv(scaled, rcond=1e-10, hermitian=True)
