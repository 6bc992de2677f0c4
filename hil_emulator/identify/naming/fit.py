"""Maximum a posteriori Gauss-Newton on the frozen innovations."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.naming.derivative import Derivative, Steps
from hil_emulator.identify.prediction.pool import Batch, LocalBatch, Point, Pool, Threads
from hil_emulator.identify.prediction.predictor import Predictor
from hil_emulator.identify.prediction.twin import Coordinate

NUDGES = (0.7, 1.4)
"""Factors of an effect's size at which a refit is begun once more (assumed)."""

TOLERATED = 2.0
"""Prior standard deviations within which an ordinary parameter is believed (assumed)."""

DAMPINGS = (1e-9, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Damping of a step over the diagonal of its normal equations, tried in turn until one helps: where
two parameters nearly make up for each other, it is their common way that a step overdoes."""

STUCK = (10.0, 100.0)
"""The same for a first step that none of them mends; later on they would only creep along valleys
that lead out of what anyone believes."""

LEAST_SEEN = 2
"""Directions along which what is believed decides."""


@dataclass
class Fit:
    """Parameters that were fitted together.

    Attributes:
        coordinates: what was free.
        at: their coordinates.
        residual: weighted innovations of the training data, flat.
        jacobian: its derivative, shape (residuals, coordinates).
        chi2: sum of squares, priors included.

    """

    coordinates: list[Coordinate]
    at: Array
    residual: Array
    jacobian: Array
    chi2: float

    def without(self, names: Collection[str]) -> "Fit":
        """Return the fit without some coordinates, everything else as it is."""
        kept = [i for i, c in enumerate(self.coordinates) if c.name not in names]
        free = [self.coordinates[i] for i in kept]
        return replace(self, coordinates=free, at=self.at[kept], jacobian=self.jacobian[:, kept])

    def covariance(self) -> Array:
        """Return the covariance of the coordinates, priors included."""
        information = self.jacobian.T @ self.jacobian + np.diag(prior_rows(self.coordinates) ** 2)
        return np.asarray(np.linalg.pinv(information), dtype=np.float64)


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

    @property
    def stretch(self) -> int:
        """Number of successive residuals that may be correlated."""
        samples = round(self.predictor.memory / self.experiments[0].period)
        return max(1, samples) * len(self.predictor.channels)

    @property
    def frozen(self) -> Sequence[Any]:
        """The frozen experiments, in this process."""
        return self.batch.frozen

    def release(self) -> None:
        """Let go of the frozen experiments, which of long recordings are large."""
        self.batch = LocalBatch(self.predictor, [])

    def freeze(self, coordinates: Sequence[Coordinate], at: Array) -> None:
        """Compute the gains at a point, and weights that give each channel's innovations one."""
        self.batch = self.frozen_at(self.experiments, coordinates, at)

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

    def loss(self, coordinates: Sequence[Coordinate], at: Array, residual: Array) -> float:
        """Return the sum of squares of a residual, priors included."""
        return float(residual @ residual + np.sum((prior_rows(coordinates) * at) ** 2))

    def cost(self, coordinates: Sequence[Coordinate], at: Array) -> float:
        """Return how much longer a residual takes at a point than usually."""
        return self.predictor.cost(self._memory(coordinates, at)[0])

    def column(self, coordinates: Sequence[Coordinate], at: Array, base: Array, i: int) -> Array:
        """Return the derivative of the residual by one coordinate."""
        return next(self.columns([Derivative(coordinates, at, i)], base))

    def columns(self, wanted: Sequence[Derivative], base: Array) -> Iterator[Array]:
        """Yield derivatives of the residual, which is `base` where each is taken."""
        steps = [self._steps.of(w) for w in wanted]
        points = [self._memory(w.coordinates, w.moved(step))
                  for w, step in zip(wanted, steps, strict=True) if step]  # fmt: skip
        residuals = self.batch.residuals(points)
        for one, step in zip(wanted, steps, strict=True):
            if step == 0.0:
                yield np.zeros_like(base)
                continue
            slope = np.asarray((next(residuals) - base) / step)
            self._steps.learn(one, slope)
            yield slope

    def jacobian(self, coordinates: Sequence[Coordinate], at: Array, base: Array) -> Array:
        """Return the derivative of the residual, shape (residuals, coordinates)."""
        wanted = [Derivative(coordinates, at, i) for i in range(len(coordinates))]
        columns = list(self.columns(wanted, base))
        return np.column_stack(columns) if columns else np.zeros((len(base), 0))

    def fit(
        self, coordinates: Sequence[Coordinate], start: Array, rounds: int = 3,
        jacobian: Array | None = None,
    ) -> Fit:  # fmt: skip
        """Minimise innovations and priors from a start.

        Args:
            coordinates: what is free.
            start: where from.
            rounds: iterations.
            jacobian: a Jacobian near by; it is corrected on the way, and its last column refreshed.

        """
        free = list(coordinates)
        at = np.array(start, dtype=np.float64)
        weights = prior_rows(free)
        bounds = np.array([c.bounds for c in free]).reshape(-1, 2)
        residual = self.residual(free, at)
        chi2 = float(residual @ residual + np.sum((weights * at) ** 2))
        slope = None if jacobian is None else jacobian.copy()
        for i in range(rounds):
            if slope is None:
                slope = self.jacobian(free, at, residual)
            elif i and jacobian is not None and len(free):
                slope[:, -1] = self.column(free, at, residual, len(free) - 1)
            fresh = i == 0 and jacobian is None
            for damping in (*DAMPINGS, *(STUCK if fresh else ())):
                step = _step(slope, residual, weights, at, damping)
                trial = np.clip(at + step, bounds[:, 0], bounds[:, 1])
                r = self.residual(free, trial)
                new = float(r @ r + np.sum((weights * trial) ** 2))
                if new < chi2:
                    break
            if new >= chi2:
                break
            _learn(slope, trial - at, r - residual)
            gained, at, residual, chi2 = chi2 - new, trial, r, new
            if gained < 0.5:
                break
        if slope is None:
            slope = self.jacobian(free, at, residual)
        return Fit(free, at, residual, slope, chi2)

    def nudged(self, fit: Fit, i: int) -> Fit:
        """Push one effect over the kinks that a delay has at every sample, a lap at every edge.

        Ordinary parameters that have gone far with it start as configured.

        Returns:
            a better fit, or the same.

        """
        best = fit
        low, high = fit.coordinates[i].bounds
        far = [np.isfinite(c.prior) and abs(a) > TOLERATED * c.prior
               for c, a in zip(fit.coordinates, fit.at, strict=True)]  # fmt: skip
        for factor in NUDGES:
            at = np.where(far, 0.0, fit.at)
            at[i] *= factor
            if low <= at[i] <= high:
                near = None if any(far) else fit.jacobian
                other = self.fit(fit.coordinates, at, 3, jacobian=near)
                best = min(best, other, key=lambda f: f.chi2)
        return best

    def relaxed(self, fit: Fit) -> Fit:
        """Let what is believed decide along the directions that the data see least.

        Difference quotients are not exact enough to follow them: underlap and overlap, say, act by
        their difference alone.
        """
        pull = prior_rows(fit.coordinates) ** 2
        normal = fit.jacobian.T @ fit.jacobian + np.diag(pull)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
        directions = scale[:, None] * np.linalg.eigh(normal * np.outer(scale, scale))[1]
        low, high = np.array([c.bounds for c in fit.coordinates]).reshape(-1, 2).T
        for way in directions.T[:LEAST_SEEN]:
            reach = float((pull * fit.at) @ way) / max(float((pull * way) @ way), 1e-30)
            for part in (1.0, 0.5):
                at = np.clip(fit.at - part * reach * way, low, high)
                residual = self.residual(fit.coordinates, at)
                loss = self.loss(fit.coordinates, at, residual)
                if loss < fit.chi2:
                    fit = replace(fit, at=at, residual=residual, chi2=loss)
                    break
        return fit

    def _memory(self, coordinates: Sequence[Coordinate], at: Array | Sequence[float]) -> Point:
        return self.predictor.twin.memory(coordinates, at)


def _learn(slope: Array, moved: Array, changed: Array) -> None:
    """Correct a Jacobian by what a step has shown (Broyden 1965)."""
    surprise = changed - slope @ moved
    # column by column: the outer product of a long recording is large
    for j, part in enumerate(moved / max(float(moved @ moved), 1e-12)):
        slope[:, j] += part * surprise


def _step(slope: Array, residual: Array, weights: Array, at: Array, damping: float) -> Array:
    """Return the Gauss-Newton step with prior rows, damped (Levenberg 1944, Marquardt 1963)."""
    normal = slope.T @ slope + np.diag(weights**2)
    gradient = slope.T @ residual + weights**2 * at
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled = normal / np.outer(scale, scale) + damping * np.eye(len(at))
    return -np.linalg.solve(scaled, gradient / scale) / scale
