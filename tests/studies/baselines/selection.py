"""Two usual selectors: forward selection by BIC, and sequentially thresholded least squares.

Ordinary parameters are refitted with their priors in both; that much is granted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from tests.studies.baselines.replay import Replay

MOST = 3
"""Effects that are looked for."""

RIDGE = 1e-3
"""Ridge of the sparse regression, relative: columns of like effects are nearly parallel."""

REFITTED = 4
"""Candidates that are refitted in each round."""


@dataclass
class Model:
    """A fitted set of coordinates.

    Attributes:
        free: what was fitted.
        at: where it ended.
        residual: shape (samples, channels).
        jacobian: derivative of the flat weighted residual.
        weights: see `weighed`.
        cost: samples times log mean square, over the channels, and the priors.

    """

    free: list[Coordinate]
    at: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    weights: np.ndarray
    cost: float

    @property
    def flat(self) -> np.ndarray:
        """Weighted residual, flat."""
        return np.asarray((self.residual * self.weights).ravel())

    def deviations(self) -> np.ndarray:
        """Return the standard deviations of the coordinates."""
        normal = self.jacobian.T @ self.jacobian + np.diag(priors(self.free) ** 2)
        return np.sqrt(np.abs(np.diag(np.linalg.pinv(normal))))


def priors(free: Sequence[Coordinate]) -> np.ndarray:
    """Return one over the prior deviations, zero without a prior."""
    return np.array([1.0 / c.prior if np.isfinite(c.prior) else 0.0 for c in free])


def cost(replay: Replay, residual: np.ndarray, free: Sequence[Coordinate], at: np.ndarray) -> float:
    """Return minus twice the log likelihood with unknown noise, and the priors."""
    power = np.maximum(np.mean(residual**2, axis=0), 1e-12)
    count = len(residual) * replay.independent
    return float(count * np.sum(np.log(power)) + np.sum((priors(free) * at) ** 2))


def column(
    replay: Replay, free: Sequence[Coordinate], at: np.ndarray, base: np.ndarray, i: int
) -> np.ndarray:
    """Return the derivative of the residual by one coordinate, shape as the residual."""
    low, high = free[i].bounds
    size = 0.05 if np.isfinite(free[i].prior) or at[i] != 0.0 else 0.3
    moved = at.copy()
    moved[i] = at[i] + size if at[i] + size <= high else max(low, at[i] - size)
    change = moved[i] - at[i]
    return (replay.residual(free, moved) - base) / change if change else np.zeros_like(base)


def fit(
    replay: Replay, free: list[Coordinate], at: np.ndarray, rounds: int,
    slopes: list[np.ndarray] | None = None,
) -> Model:  # fmt: skip
    """Minimise the cost by Gauss-Newton; given slopes are kept, the last one is refreshed."""
    bounds = np.array([c.bounds for c in free])
    residual, chord = replay.residual(free, at), slopes is not None
    now = cost(replay, residual, free, at)
    for turn in range(rounds):
        if chord and slopes is not None:
            slopes = [*slopes[: len(free) - 1], column(replay, free, at, residual, len(free) - 1)]
        elif turn == 0 or slopes is None:
            slopes = [column(replay, free, at, residual, i) for i in range(len(free))]
        step = _step(replay, slopes, residual, free, at)
        for shorter in (1.0, 0.4, 0.15):
            trial = np.clip(at + shorter * step, bounds[:, 0], bounds[:, 1])
            moved = replay.residual(free, trial)
            new = cost(replay, moved, free, trial)
            if new < now:
                break
        if new >= now:
            break
        at, residual, gained, now = trial, moved, now - new, new
        if gained < 1.0:
            break
    weights = weighed(replay, residual)
    jacobian = np.column_stack([(s * weights).ravel() for s in slopes or []])
    return Model(list(free), at, residual, jacobian, weights, now)


def weighed(replay: Replay, residual: np.ndarray) -> np.ndarray:
    """Return the weight of each channel: over its root mean square, dependent samples once."""
    power = np.maximum(np.mean(residual**2, axis=0), 1e-12)
    return np.asarray(np.sqrt(replay.independent / power))


def _step(
    replay: Replay, slopes: list[np.ndarray], residual: np.ndarray, free: Sequence[Coordinate],
    at: np.ndarray,
) -> np.ndarray:  # fmt: skip
    weights = weighed(replay, residual)
    j = np.column_stack([(s * weights).ravel() for s in slopes])
    w = priors(free)
    normal = j.T @ j + np.diag(w**2) + 1e-9 * np.eye(len(free))
    return -np.linalg.solve(normal, j.T @ (residual * weights).ravel() + w**2 * at)


def projected(model: Model, columns: np.ndarray) -> np.ndarray:
    """Return weighted columns without what the model's coordinates can explain."""
    normal = model.jacobian.T @ model.jacobian + np.diag(priors(model.free) ** 2)
    return columns - model.jacobian @ np.linalg.lstsq(normal, model.jacobian.T @ columns)[0]


def screened(
    replay: Replay, model: Model, candidates: Sequence[Coordinate]
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return projected weighted columns of all candidates, and their slopes."""
    slopes = [
        column(replay, [*model.free, c], np.append(model.at, 0.0), model.residual, len(model.free))
        for c in candidates
    ]
    weighted = np.column_stack([(s * model.weights).ravel() for s in slopes])
    return projected(model, weighted), slopes


def by_bic(
    replay: Replay, nuisances: list[Coordinate], candidates: list[Coordinate]
) -> tuple[Model, list[Coordinate]]:
    """Add the effect that lowers the cost most, as long as BIC falls.

    Returns:
        The last model, and the chosen effects in order.

    """
    model = fit(replay, list(nuisances), np.zeros(len(nuisances)), 4)
    chosen: list[Coordinate] = []
    while len(chosen) < MOST:
        rest = [c for c in candidates if c not in chosen]
        columns, slopes = screened(replay, model, rest)
        power = np.maximum(np.sum(columns**2, axis=0), 1e-9)
        gains = (columns.T @ model.flat) ** 2 / power
        base = [s.reshape(model.residual.shape) / model.weights for s in model.jacobian.T]
        trials = [
            fit(replay, [*model.free, rest[i]], np.append(model.at, 0.0), 3, [*base, slopes[i]])
            for i in np.argsort(-gains)[:REFITTED]
        ]
        best = min(trials, key=lambda m: m.cost)
        if model.cost - best.cost < np.log(model.residual.size * replay.independent):
            break
        chosen.append(best.free[-1])
        model = fit(replay, best.free, best.at, 2)
    return model, chosen


def by_thresholds(
    replay: Replay, nuisances: list[Coordinate], candidates: list[Coordinate]
) -> tuple[Model, list[tuple[Coordinate, float]]]:
    """Regress on all candidates at once and drop the small ones (STLSQ); BIC sets the threshold.

    Returns:
        The model of ordinary parameters, and the kept effects with their coordinates.

    """
    model = fit(replay, list(nuisances), np.zeros(len(nuisances)), 4)
    columns, _ = screened(replay, model, candidates)
    gram, moment = columns.T @ columns, columns.T @ model.flat
    power = float(model.flat @ model.flat)
    size = model.flat.size * replay.independent
    best, kept = np.inf, np.zeros(len(candidates))
    for threshold in np.geomspace(0.01, 10.0, 16):
        solution = _thresholded(gram, moment, threshold)
        rest = power + solution @ (2.0 * moment + gram @ solution)
        bic = size * np.log(rest / size) + np.count_nonzero(solution) * np.log(size)
        if bic < best:
            best, kept = bic, solution
    order = [i for i in np.argsort(-np.abs(kept)) if kept[i]]
    return model, [(candidates[i], float(kept[i])) for i in order]


def _thresholded(gram: np.ndarray, moment: np.ndarray, threshold: float) -> np.ndarray:
    """Return the coefficients that stay above a threshold, in typical sizes."""
    active = np.diag(gram) > 1e-6
    solution = np.zeros(len(moment))
    for _ in range(10):
        solution[:] = 0.0
        if not active.any():
            break
        part = gram[np.ix_(active, active)] + RIDGE * np.diag(np.diag(gram)[active])
        solution[active] = np.linalg.solve(part, -moment[active])
        still = active & (np.abs(solution) > threshold)
        if (still == active).all():
            break
        active = still
    return np.where(active, solution, 0.0)
