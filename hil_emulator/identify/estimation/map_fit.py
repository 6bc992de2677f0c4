"""Maximum a posteriori Gauss-Newton on the frozen innovations."""

import copy
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.clusters import Clusters, places_of
from hil_emulator.identify.estimation.finite_difference import Derivative, Steps
from hil_emulator.identify.estimation.levenberg_marquardt import learn, steps
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.prediction.pool import Batch, LocalBatch, Point, Pool, Threads
from hil_emulator.identify.prediction.predictor import Predictor

TOLERATED = 2.0
"""Prior standard deviations within which an ordinary parameter is believed: 95 % of machines have
it there, as of any normal distribution."""

HARDLY_TOLD = 1e-13
"""Part of the best known direction's information below which rounding decides: 16 digits hold the
sum of a thousand products to that."""

LEAST_GAIN = 0.5
"""Gain in chi-square of an iteration below which it was the last one."""

_BLOCK = 1 << 16  # rows that are added up at once


@dataclass
class Fit:
    """Parameters that were fitted together.

    Attributes:
        coordinates: what was free.
        at: their coordinates.
        residual: weighted innovations of the training data, flat.
        jacobian: its derivative, shape (residuals, coordinates).
        chi2: sum of squares, priors included.
        effective: number of independent values among the residuals; None for all of them.
        settled: whether no step by this Jacobian leads further.
        further: covariance of the coordinates beyond that of noise; None for none.

    """

    coordinates: list[Coordinate]
    at: Array
    residual: Array
    jacobian: Array
    chi2: float
    effective: float | None = None
    settled: bool = False
    further: Array | None = None

    @property
    def sample_size(self) -> float:
        """Number of independent values."""
        return float(len(self.residual)) if self.effective is None else self.effective

    def without(self, names: Collection[str]) -> "Fit":
        """Return the fit without some coordinates, everything else as it is."""
        kept = [i for i, c in enumerate(self.coordinates) if c.name not in names]
        free = [self.coordinates[i] for i in kept]
        further = None if self.further is None else self.further[np.ix_(kept, kept)]
        return replace(
            self, coordinates=free, at=self.at[kept], jacobian=self.jacobian[:, kept],
            further=further,
        )  # fmt: skip

    def lean(self) -> "Fit":
        """Return the fit with half the memory: Jacobians of several of a long recording are large.

        A further fit may begin with such a one: it corrects it on the way.
        """
        return replace(self, jacobian=self.jacobian.astype(np.float32))

    def covariance(self) -> Array:
        """Return the covariance of the coordinates, priors included.

        What data and priors hardly tell takes no part, so that rounding makes no variance negative.
        """
        information = np.diag(prior_rows(self.coordinates) ** 2)
        for first in range(0, len(self.jacobian), _BLOCK):  # of a lean fit's, exact all the same
            block = self.jacobian[first : first + _BLOCK].astype(np.float64)
            information += block.T @ block
        told = np.diag(information)
        scale = 1.0 / np.sqrt(np.where(told > 0.0, told, 1.0))
        values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
        kept = values > HARDLY_TOLD * values[-1] if len(values) else values > 0.0
        root = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
        known = root @ root.T
        return np.asarray(known if self.further is None else known + self.further)


@dataclass(frozen=True)
class Linearised:
    """Experiments as a fit sees them.

    Attributes:
        batch: the experiments, frozen.
        residual: weighted innovations at the fit, flat.
        jacobian: its derivative, shape (residuals, coordinates).

    """

    batch: Batch
    residual: Array
    jacobian: Array


def prior_rows(coordinates: Sequence[Coordinate]) -> Array:
    """Return one over the prior's standard deviation of each coordinate."""
    return np.array([1.0 / c.prior if np.isfinite(c.prior) else 0.0 for c in coordinates])


class Fitter:
    """Fits coordinates to frozen experiments.

    Args:
        predictor: computes innovations.
        experiments: the training data.
        pool: where they are predicted; without one, in this thread.

    """

    def __init__(
        self, predictor: Predictor, experiments: Sequence[Experiment], pool: Pool | None = None
    ) -> None:
        self.predictor = predictor
        self.experiments = list(experiments)
        self.batch: Batch = LocalBatch(predictor, [])
        self._pool = Threads(predictor) if pool is None else pool
        self._steps = Steps()
        self._own: tuple[Batch, Point] | None = None

    @property
    def correlation_length(self) -> int:
        """Number of successive residuals that may be correlated."""
        noise = self.batch.noise
        time = self.predictor.correlation_time if noise is None else noise.memory
        samples = round(time / self.experiments[0].period)
        return max(1, samples) * len(self.predictor.channels)

    @property
    def clusters(self) -> Clusters:
        """Which residuals of the training data may be correlated."""
        places = np.concatenate(places_of(self.experiments))
        return Clusters(self.correlation_length, np.repeat(places, len(self.predictor.channels)))

    @property
    def frozen(self) -> Sequence[object]:
        """The frozen experiments, in this process."""
        return self.batch.frozen

    @property
    def jobs(self) -> int:
        """Threads of this process that predict."""
        return self._pool.jobs if isinstance(self._pool, Threads) else 1

    def seeing(self, batch: Batch) -> "Fitter":
        """Return a fitter like this one that sees other frozen data."""
        other = copy.copy(self)
        other.batch = batch
        return other

    def release(self) -> None:
        """Let go of the frozen experiments, which of long recordings are large."""
        self.batch, self._own = LocalBatch(self.predictor, []), None

    def freeze(self, coordinates: Sequence[Coordinate], at: Array) -> None:
        """Compute the gains at a point, and weights that give each channel's innovations one."""
        point = self._memory(coordinates, at)
        if self._own is not None and _same(self._own[1], point):
            self.batch = self._own[0]
            return
        self.release()
        self.batch = self._pool.freeze(self.experiments, point)
        self._own = self.batch, point

    def frozen_at(
        self, experiments: Sequence[Experiment], coordinates: Sequence[Coordinate], at: Array
    ) -> Batch:
        """Return other experiments with their gains and weights at a point."""
        return self._pool.freeze(experiments, self._memory(coordinates, at))

    def residual(
        self, coordinates: Sequence[Coordinate], at: Array | Sequence[float],
        batch: Batch | None = None,
    ) -> Array:  # fmt: skip
        """Return the weighted innovations at a point, flat, of all experiments."""
        chosen = self.batch if batch is None else batch
        return next(chosen.residuals([self._memory(coordinates, at)]))

    def residuals(
        self, coordinates: Sequence[Coordinate], points: Sequence[Array]
    ) -> Iterator[Array]:
        """Yield the residual at each of several points."""
        yield from self.batch.residuals([self._memory(coordinates, at) for at in points])

    def within(
        self, coordinates: Sequence[Coordinate], points: Sequence[Array], most: float
    ) -> Iterator[tuple[Array, float] | None]:
        """Yield the residual at each of several points and the loss there; None of one beyond."""
        believed = [self.loss(coordinates, at, np.zeros(0)) for at in points]
        memories = [self._memory(coordinates, at) for at in points]
        least = most - min(believed, default=0.0)
        residuals = self.batch.residuals(memories, least)
        for prior, residual in zip(believed, residuals, strict=True):
            loss = float(residual @ residual) + prior
            yield (residual, loss) if loss <= most else None

    def loss(self, coordinates: Sequence[Coordinate], at: Array, residual: Array) -> float:
        """Return the sum of squares of a residual, priors included."""
        return float(residual @ residual + np.sum((prior_rows(coordinates) * at) ** 2))

    def cost(self, coordinates: Sequence[Coordinate], at: Array) -> float:
        """Return how much longer a residual takes at a point than usually."""
        return self.predictor.cost(self._memory(coordinates, at)[0])

    def column(self, coordinates: Sequence[Coordinate], at: Array, base: Array, i: int) -> Array:
        """Return the derivative of the residual by one coordinate."""
        return next(self.columns([Derivative(coordinates, at, i)], base))

    def columns(
        self, wanted: Sequence[Derivative], base: Array, roughly: bool = False
    ) -> Iterator[Array]:
        """Yield derivatives of the residual, which is `base` where each is taken.

        Roughly, sensors of one point read the same run: where pressures bend the flow through an
        edge, such a column may be a tenth off.
        """
        steps = [self._steps.of(w) for w in wanted]
        moves = [(w, s) for w, s in zip(wanted, steps, strict=True) if s]
        residuals = self._roughly(moves) if roughly else self._moved(moves)
        # far from a fit a long step leads on; only where noise is left would it hold that
        only_noise = base @ base <= self.batch.weight**2 * len(base)
        for one, step in zip(wanted, steps, strict=True):
            if step == 0.0:
                yield np.zeros_like(base)
                continue
            sensitivity = np.asarray((next(residuals) - base) / step)
            self._steps.learn(one, sensitivity)
            if only_noise and (shorter := self._steps.again(one, step)):
                near = self.residual(one.coordinates, one.moved(shorter))
                sensitivity = np.asarray((near - base) / shorter)
                self._steps.learn(one, sensitivity)
            yield sensitivity

    def _moved(self, moves: Sequence[tuple[Derivative, float]]) -> Iterator[Array]:
        """Yield the residual a step away from where each derivative is taken."""
        yield from self.batch.residuals([self._memory(w.coordinates, w.moved(s)) for w, s in moves])

    def _roughly(self, moves: Sequence[tuple[Derivative, float]]) -> Iterator[Array]:
        """Yield the same, of sensors along the run at the first one's point."""
        bases = [self._memory(w.coordinates, w.at) for w, _ in moves if w.coordinate.channel]
        if not bases:
            yield from self._moved(moves)
            return
        points = [self._memory(w.coordinates, w.moved(s)) for w, s in moves]
        sensors = [p for p, (w, _) in zip(points, moves, strict=True) if w.coordinate.channel]
        read = self.batch.with_other_sensors(bases[0], sensors)
        others = [m for m in moves if not m[0].coordinate.channel]
        moved = self._moved(others)
        for one, _ in moves:
            yield next(read if one.coordinate.channel else moved)

    def jacobian(self, coordinates: Sequence[Coordinate], at: Array, base: Array) -> Array:
        """Return the derivative of the residual, shape (residuals, coordinates)."""
        wanted = [Derivative(coordinates, at, i) for i in range(len(coordinates))]
        jacobian = np.empty((len(base), len(wanted)))
        for i, column in enumerate(self.columns(wanted, base)):
            jacobian[:, i] = column
        return jacobian

    def elsewhere(self, fit: Fit, batch: Batch) -> Linearised:
        """Return other experiments as a fit sees them."""
        coordinates, at = fit.coordinates, fit.at
        wanted = [Derivative(coordinates, at, i) for i in range(len(coordinates))]
        steps = [self._steps.of(w) for w in wanted]
        points = [w.moved(step) for w, step in zip(wanted, steps, strict=True)]
        residuals = batch.residuals([self._memory(coordinates, p) for p in (at, *points)])
        base = next(residuals)
        jacobian = np.zeros((len(base), len(wanted)))
        for i, (moved, step) in enumerate(zip(residuals, steps, strict=True)):
            if step:
                jacobian[:, i] = (moved - base) / step
        return Linearised(batch, base, jacobian)

    def fit(
        self, coordinates: Sequence[Coordinate], start: Array, rounds: int = 3,
        jacobian: Array | None = None, enough: float = LEAST_GAIN, known: float = math.inf,
    ) -> Fit:  # fmt: skip
        """Minimise innovations and priors from a start.

        Args:
            coordinates: what is free.
            start: where from.
            rounds: iterations.
            jacobian: a Jacobian near by; it is corrected on the way, and its last column refreshed.
            enough: gain in chi-square of an iteration below which it was the last one.
            known: chi-square of another fit: one that has come back to that, or as near as this,
                ends.

        """
        free, weights = list(coordinates), prior_rows(coordinates)
        at = np.array(start, dtype=np.float64)
        residual = self.residual(free, at)
        chi2, settled = self.loss(free, at, residual), False
        sensitivities = None if jacobian is None else jacobian.astype(np.float64)
        for i in range(rounds):
            if sensitivities is None:
                sensitivities = self.jacobian(free, at, residual)
            elif i and jacobian is not None and len(free):
                sensitivities[:, -1] = self.column(free, at, residual, len(free) - 1)
            ways = steps(sensitivities, residual, weights, at, i == 0 and jacobian is None)
            better = self._improved(free, at, chi2, ways)
            if better is None:
                settled = True
                break
            before, last = chi2, at
            at, changed, chi2 = better[0], better[1] - residual, better[2]
            learn(sensitivities, at - last, changed)
            residual = better[1]
            if before - chi2 < enough or abs(chi2 - known) < enough:
                break
        if sensitivities is None:
            sensitivities = self.jacobian(free, at, residual)
        effective = None if self.batch.noise is None else self.batch.noise.sample_size
        return Fit(free, at, residual, sensitivities, chi2, effective, settled)

    def _improved(
        self, free: Sequence[Coordinate], at: Array, chi2: float, ways: Iterator[Array]
    ) -> tuple[Array, Array, float] | None:
        """Return where the first step leads that lessens the loss, the residual and loss there."""
        low, high = np.array([c.bounds for c in free]).reshape(-1, 2).T
        for step in ways:
            trial = np.clip(at + step, low, high)
            found = next(self.within(free, [trial], chi2))
            if found is not None and found[1] < chi2:
                return trial, *found
        return None

    def _memory(self, coordinates: Sequence[Coordinate], at: Array | Sequence[float]) -> Point:
        return self.predictor.model.memory(coordinates, at)


def _same(one: Point, other: Point) -> bool:
    """Tell whether two points are equal to the last bit, in a parameter that is unset as well."""
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))
