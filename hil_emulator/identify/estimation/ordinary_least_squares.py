"""Ordinary least squares fit of the named effects, for comparison.

Each channel is weighted by its standard deviation. There are no priors, no noise model and no
robust loss; parameters that the data do not determine are arbitrary.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

STEP = 1e-3
"""Step of the numerical derivatives, in units of a coordinate's scale (assumed)."""

MOST_EVALUATIONS = 30
"""Iterations of the fit, which starts at good values (assumed)."""


def ordinary_least_squares(
    predictor: Predictor, experiments: Sequence[Experiment], fit: Fit
) -> Fit:  # fmt: skip
    """Refit the coordinates of a fit by ordinary least squares.

    Args:
        predictor: predicts the readings.
        experiments: the training data.
        fit: with the free coordinates and their starting values.

    """
    free = fit.coordinates
    if not free:
        return fit
    frozen = [predictor.freeze(e, *predictor.model.memory(free, fit.at)) for e in experiments]
    spreads = _spreads(predictor.channels, experiments)

    def errors(at: Array) -> Array:
        point = predictor.model.memory(free, at)
        return np.concatenate([
            (predictor.innovations(f, *point)[0] / spreads).ravel() for f in frozen
        ])  # fmt: skip

    def slopes(at: Array) -> Array:
        base = errors(at)
        steps = np.diag([_step(c, float(a)) for c, a in zip(free, at, strict=True)])
        return np.column_stack([(errors(at + s) - base) / s.sum() for s in steps])

    low, high = np.array([c.bounds for c in free]).T
    solution = least_squares(
        errors, np.clip(fit.at, low, high), slopes, (low, high), x_scale="jac",
        max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    return Fit(free, solution.x, solution.fun, solution.jac, float(2.0 * solution.cost))


def _spreads(channels: tuple[str, ...], experiments: Sequence[Experiment]) -> Array:
    """Return the standard deviation of each channel's readings over all experiments."""
    readings = np.vstack([e.matrix(channels) for e in experiments])
    spreads = np.nanstd(readings, axis=0)
    return np.asarray(np.where(spreads > 0.0, spreads, 1.0))


def _step(coordinate: Coordinate, at: float) -> float:
    """Return a step that stays within bounds."""
    return STEP if at + STEP <= coordinate.bounds[1] else -STEP
