"""Maximum a posteriori fit by Gauss-Newton steps, with fixed filter gains."""

import copy
import math
from collections.abc import Iterator, Sequence

import numpy as np

from hil_emulator.identify.estimation.clusters import Clusters, places_of
from hil_emulator.identify.estimation.finite_difference import Derivative, Steps
from hil_emulator.identify.estimation.fit import Fit, Linearised, prior_rows
from hil_emulator.identify.estimation.levenberg_marquardt import steps, update
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.parallel.pool import Batch, LocalBatch, Point, Pool, Threads
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.residuals.correlation import block_time

LEAST_GAIN = 0.5
"""Gain in chi-square of an iteration below which a fit ends."""


class Fitter:
    """Fits coordinates to frozen experiments, that is with fixed filter gains and weights.

    Args:
        predictor: computes innovations.
        experiments: the training data.
        pool: predicts the experiments; None for this thread.

    """

    def __init__(
        self, predictor: Predictor, experiments: Sequence[Experiment], pool: Pool | None = None
    ) -> None:
        self.predictor = predictor
        self.experiments = list(experiments)
        self.batch: Batch = LocalBatch(predictor, [])
        self._pool = Threads(predictor) if pool is None else pool
        self._steps = Steps()
        self._cached: tuple[Batch, Point] | None = None
        self._block_time = predictor.correlation_time

    @property
    def correlation_length(self) -> int:
        """Number of successive residuals that may be correlated."""
        noise = self.batch.noise
        time = self._block_time if noise is None else noise.memory
        samples = round(time / self.experiments[0].period)
        return max(1, samples) * len(self.predictor.channels)

    @property
    def clusters(self) -> Clusters:
        """Groups of residuals of the training data that may be correlated."""
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

    def with_batch(self, batch: Batch) -> "Fitter":
        """Return a copy of this fitter with other frozen data."""
        other = copy.copy(self)
        other.batch = batch
        return other

    def on(self, experiments: Sequence[Experiment]) -> "Fitter":
        """Return a fitter with other training data."""
        return Fitter(self.predictor, experiments, self._pool)

    def release(self) -> None:
        """Delete the frozen experiments, which are large for long recordings."""
        self.batch, self._cached = LocalBatch(self.predictor, []), None

    def freeze(self, coordinates: Sequence[Coordinate], at: Array) -> None:
        """Compute filter gains and weights at a point, and the correlation time of the innovations.

        The weights give each channel's innovations unit variance.
        """
        point = self._memory(coordinates, at)
        if self._cached is not None and _same(self._cached[1], point):
            self.batch = self._cached[0]
            return
        self.release()
        self.batch = self._pool.freeze(self.experiments, point)
        self._cached = self.batch, point
        if self.batch.noise is None:
            self._block_time = self._block_time_of(self.residual(coordinates, at))

    def _block_time_of(self, residual: Array) -> float:
        """Return the length of uncorrelated blocks of the training data's innovations [s]."""
        ends = np.cumsum([e.samples for e in self.experiments])[:-1]
        each = np.split(residual.reshape(-1, len(self.predictor.channels)), ends)
        periods = [e.period for e in self.experiments]
        return block_time(each, periods, self.predictor.correlation_time)

    def frozen_at(
        self, experiments: Sequence[Experiment], coordinates: Sequence[Coordinate], at: Array
    ) -> Batch:
        """Return other experiments with gains and weights of a point."""
        return self._pool.freeze(experiments, self._memory(coordinates, at))

    def residual(
        self, coordinates: Sequence[Coordinate], at: Array | Sequence[float],
        batch: Batch | None = None,
    ) -> Array:  # fmt: skip
        """Return the weighted innovations of all experiments at a point, flat."""
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
        """Yield residual and loss at each of several points; None for a loss above `most`."""
        penalties = [self.loss(coordinates, at, np.zeros(0)) for at in points]
        memories = [self._memory(coordinates, at) for at in points]
        largest = most - min(penalties, default=0.0)
        residuals = self.batch.residuals(memories, largest)
        for prior, residual in zip(penalties, residuals, strict=True):
            loss = float(residual @ residual) + prior
            yield (residual, loss) if loss <= most else None

    def loss(self, coordinates: Sequence[Coordinate], at: Array, residual: Array) -> float:
        """Return the sum of squares of a residual, priors included."""
        return float(residual @ residual + np.sum((prior_rows(coordinates) * at) ** 2))

    def deviance(self, coordinates: Sequence[Coordinate], at: Array) -> float:
        """Return -2 log posterior density at the point of the gains, up to a constant.

        Fits with different gains are compared by their deviance, fits with the same gains by
        chi-square. NaN if the covariance of the innovations does not depend on the point; infinite
        if the filter diverges there.
        """
        log_determinant = self.batch.log_determinant()
        if math.isinf(log_determinant):
            return math.inf
        return self.loss(coordinates, at, self.residual(coordinates, at)) + log_determinant

    def cost(self, coordinates: Sequence[Coordinate], at: Array) -> float:
        """Return the computing time of a residual at a point over the usual time."""
        return self.predictor.cost(self._memory(coordinates, at)[0])

    def column(self, coordinates: Sequence[Coordinate], at: Array, base: Array, i: int) -> Array:
        """Return the derivative of the residual by one coordinate."""
        return next(self.columns([Derivative(coordinates, at, i)], base))

    def columns(
        self, wanted: Sequence[Derivative], base: Array, approximate: bool = False
    ) -> Iterator[Array]:
        """Yield derivatives of the residual.

        Args:
            wanted: derivatives, all at the point of `base`.
            base: residual there.
            approximate: whether derivatives by sensor errors share one run of the model. Their
                error is up to 10 % where the readings change the flow through an edge.

        """
        steps = [self._steps.of(w) for w in wanted]
        moves = [(w, s) for w, s in zip(wanted, steps, strict=True) if s]
        residuals = self._approximate(moves) if approximate else self._moved(moves)
        # near a fit, a long step would be biased by noise; far from it, a long step is robust
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
        """Yield the residual at the displaced point of each derivative."""
        yield from self.batch.residuals([self._memory(w.coordinates, w.moved(s)) for w, s in moves])

    def _approximate(self, moves: Sequence[tuple[Derivative, float]]) -> Iterator[Array]:
        """Yield the same, with one run of the model for all derivatives by sensor errors."""
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

    def linearised(self, fit: Fit, batch: Batch) -> Linearised:
        """Return other experiments linearised at a fit."""
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
        jacobian: Array | None = None, enough: float = LEAST_GAIN, reference: float = math.inf,
    ) -> Fit:  # fmt: skip
        """Minimise chi-square, priors included, from a starting point.

        Args:
            coordinates: that are free.
            start: their starting values.
            rounds: largest number of iterations.
            jacobian: Jacobian of a point near by. It is updated, and its last column is recomputed
                in each iteration.
            enough: gain in chi-square of an iteration below which the fit ends.
            reference: chi-square of another fit; a fit that returns to it, within `enough`, ends.

        """
        free, weights = list(coordinates), prior_rows(coordinates)
        at = np.array(start, dtype=np.float64)
        residual = self.residual(free, at)
        chi2, converged = self.loss(free, at, residual), False
        sensitivities = None if jacobian is None else jacobian.astype(np.float64)
        low, high = np.array([c.bounds for c in free]).reshape(-1, 2).T
        bounds = low, high
        # without an earlier one, the steps of a derivative may be too long
        accurate = self._steps.learned(free)
        for i in range(rounds):
            if sensitivities is None:
                sensitivities = self.jacobian(free, at, residual)
            elif i and jacobian is not None and len(free):
                sensitivities[:, -1] = self.column(free, at, residual, len(free) - 1)
            first = i == 0 and jacobian is None
            trial_steps = steps(sensitivities, residual, weights, at, bounds, first)
            better = self._improved(free, at, chi2, bounds, trial_steps)
            if better is None and first and not accurate:
                sensitivities = self.jacobian(free, at, residual)
                trial_steps = steps(sensitivities, residual, weights, at, bounds, first)
                better = self._improved(free, at, chi2, bounds, trial_steps)
            if better is None:
                converged = True
                break
            before, last = chi2, at
            at, changed, chi2 = better[0], better[1] - residual, better[2]
            update(sensitivities, at - last, changed)
            residual = better[1]
            if before - chi2 < enough or abs(chi2 - reference) < enough:
                break
        if sensitivities is None:
            sensitivities = self.jacobian(free, at, residual)
        effective = None if self.batch.noise is None else self.batch.noise.sample_size
        return Fit(free, at, residual, sensitivities, chi2, effective, converged)

    def _improved(
        self,
        free: Sequence[Coordinate],
        at: Array,
        chi2: float,
        bounds: tuple[Array, Array],
        trial_steps: Iterator[Array],
    ) -> tuple[Array, Array, float] | None:
        """Return point, residual and loss after the first step that reduces the loss."""
        for step in trial_steps:
            within = np.clip(at + step, *bounds).tolist()
            trial = np.array([c.possible(x) for c, x in zip(free, within, strict=True)])
            evaluated = next(self.within(free, [trial], chi2))
            if evaluated is not None and evaluated[1] < chi2:
                return trial, *evaluated
        return None

    def _memory(self, coordinates: Sequence[Coordinate], at: Array | Sequence[float]) -> Point:
        return self.predictor.model.memory(coordinates, at)


def _same(one: Point, other: Point) -> bool:
    """Return whether two points are equal bit by bit, NaN included."""
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))
