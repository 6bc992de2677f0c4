"""Maximum a posteriori Gauss-Newton on the frozen innovations."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.predictor import Predictor
from hil_emulator.identify.prediction.twin import Coordinate

DIFFERENCE = 0.05
"""Step of a derivative by an ordinary parameter, in prior standard deviations."""

FINITE = 0.3
"""Step of a derivative by an effect, in typical sizes: finite on purpose, since dead bands,
hysteresis and stops have no slope at zero."""

NUDGES = (0.7, 1.4)
"""Factors of an effect's size at which a refit is begun once more (assumed)."""

TOLERATED = 2.0
"""Prior standard deviations within which an ordinary parameter is believed (assumed)."""

DAMPINGS = (1e-9, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Damping of a step over the diagonal of its normal equations, tried in turn until one helps: where
two parameters nearly make up for each other, it is their common way that a step overdoes."""

DISTINCT = 2.0
"""Norm of the residual's change that a step of a derivative need not exceed."""

OUTLIER = 3.0
"""Whitened innovations beyond this count linearly, not squared (Huber): cavitation and knocks make
a few large ones that would otherwise decide alone."""

WORST = 100.0
"""Whitened innovation of a prediction that ran away."""


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
        jobs: threads.

    """

    def __init__(self, predictor: Predictor, experiments: Sequence[Experiment], jobs: int) -> None:
        self.predictor = predictor
        self.experiments = list(experiments)
        self.frozen: list[Any] = []
        self._jobs = jobs
        self._sensitivity: dict[str, float] = {}

    @property
    def stretch(self) -> int:
        """Number of successive residuals that may be correlated."""
        samples = round(self.predictor.memory / self.experiments[0].period)
        return max(1, samples) * len(self.predictor.channels)

    def freeze(self, coordinates: Sequence[Coordinate], at: Array) -> None:
        """Compute the gains at a point, and weights that give each channel's innovations one."""
        par, chan = self.predictor.twin.memory(coordinates, at)
        self.frozen = [self.predictor.freeze(e, par, chan) for e in self.experiments]
        for frozen in self.frozen:
            self.predictor.weigh(frozen, par, chan)

    def residual(
        self, coordinates: Sequence[Coordinate], at: Array | Sequence[float],
        frozen: Sequence[Any] | None = None,
    ) -> Array:  # fmt: skip
        """Return the weighted innovations at a point, flat, of all experiments."""
        par, chan = self.predictor.twin.memory(coordinates, at)
        chosen = self.frozen if frozen is None else frozen
        parts = [self.predictor.innovations(f, par, chan)[0].ravel() for f in chosen]
        flat = np.concatenate(parts)
        np.nan_to_num(flat, copy=False, nan=WORST, posinf=WORST, neginf=-WORST)
        return tamed(np.clip(flat, -WORST, WORST))

    def chi2(self, coordinates: Sequence[Coordinate], at: Array) -> float:
        """Return the sum of squares at a point, priors included."""
        return self.loss(coordinates, at, self.residual(coordinates, at))

    def loss(self, coordinates: Sequence[Coordinate], at: Array, residual: Array) -> float:
        """Return the sum of squares of a residual, priors included."""
        return float(residual @ residual + np.sum((prior_rows(coordinates) * at) ** 2))

    def cost(self, coordinates: Sequence[Coordinate], at: Array) -> float:
        """Return how much longer a residual takes at a point than usually."""
        return self.predictor.cost(self.predictor.twin.memory(coordinates, at)[0])

    def map(self, function: Callable[[int], Array], items: Iterable[int]) -> list[Array]:
        """Apply a function on threads: the compiled code does not hold the interpreter."""
        if self._jobs <= 1:
            return [function(i) for i in items]
        with ThreadPoolExecutor(self._jobs) as pool:
            return list(pool.map(function, items))

    def column(self, coordinates: Sequence[Coordinate], at: Array, base: Array, i: int) -> Array:
        """Return the derivative of the residual by one coordinate."""
        coordinate = coordinates[i]
        low, high = coordinate.bounds
        size = DIFFERENCE if np.isfinite(coordinate.prior) else FINITE
        if coordinate.inverse:
            size = 1.0
        elif not np.isfinite(coordinate.prior) and at[i] != 0.0:
            size = max(0.05 * abs(float(at[i])), 0.01)
        if at[i] != 0.0 or np.isfinite(coordinate.prior):
            # far beyond its own uncertainty a parameter has another slope
            size = min(size, DISTINCT / self._sensitivity.get(coordinate.name, 1e-9))
        step = min(size, high - at[i]) if high - at[i] > at[i] - low else -min(size, at[i] - low)
        if step == 0.0:
            return np.zeros_like(base)
        moved = np.array(at, dtype=np.float64)
        moved[i] += step
        slope = np.asarray((self.residual(coordinates, moved) - base) / step)
        self._sensitivity[coordinate.name] = max(float(np.linalg.norm(slope)), 1e-9)
        return slope

    def jacobian(self, coordinates: Sequence[Coordinate], at: Array, base: Array) -> Array:
        """Return the derivative of the residual, shape (residuals, coordinates)."""
        columns = self.map(lambda i: self.column(coordinates, at, base, i), range(len(coordinates)))
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
            for damping in DAMPINGS:
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


def tamed(residual: Array) -> Array:
    """Return residuals whose squares are Huber's loss of the given ones."""
    size = np.abs(residual)
    rooted = np.sqrt(np.maximum(2.0 * OUTLIER * size - OUTLIER**2, 0.0))
    return np.asarray(np.where(size > OUTLIER, np.sign(residual) * rooted, residual))
