"""Damped Gauss-Newton steps, limits of residuals, and convergence."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from hil_emulator.identify.estimation.levenberg_marquardt import (
    DAMPINGS,
    LEAST_PREDICTED,
    LEAST_PREDICTED_DAMPED,
    steps,
)
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.residuals.huber import OUTLIER, WORST, tamed
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

WEIGHTS = np.ones(2)
ANYWHERE = np.full(2, -np.inf), np.full(2, np.inf)
PARALLEL = np.array([[1.0, 1.0], [0.0, 1e-3], [0.0, 0.0]])
"""Jacobian of two coordinates that nearly make up for each other."""


def offered(jacobian: np.ndarray, size: float) -> list[np.ndarray]:
    """Return all steps for a residual of some size along the first column."""
    residual = size * jacobian[:, 0]
    return list(steps(jacobian, residual, WEIGHTS, np.zeros(2), ANYWHERE, first=False))


def test_the_first_step_is_the_minimum_of_the_linear_model() -> None:
    """The first step solves the normal equations with priors."""
    residual = np.array([3.0, 0.5, -1.0])
    first = next(steps(PARALLEL, residual, WEIGHTS, np.zeros(2), ANYWHERE, first=False))
    stacked = np.vstack([PARALLEL, np.eye(2)])
    wanted = np.linalg.lstsq(stacked, -np.append(residual, [0.0, 0.0]), rcond=None)[0]
    assert first == pytest.approx(wanted, rel=1e-6)


def test_a_step_that_meets_a_bound_is_the_minimum_within_it() -> None:
    """The step equals that of scipy's bounded least squares."""
    jacobian = np.array([[1.0, 1.0], [0.0, 0.3], [0.5, 0.0]])
    residual = np.array([3.0, 0.5, -1.0])
    bounds = np.array([-0.2, -9.0]), np.array([9.0, 9.0])
    first = next(steps(jacobian, residual, WEIGHTS, np.zeros(2), bounds, first=False))
    stacked = np.vstack([jacobian, np.eye(2)])
    wanted = lsq_linear(stacked, -np.append(residual, [0.0, 0.0]), bounds)
    assert wanted.x[0] == pytest.approx(-0.2)
    assert first == pytest.approx(wanted.x, rel=1e-6)


def test_no_step_with_a_small_predicted_gain_is_tried() -> None:
    """A fit at its minimum ends; after a failed step the predicted gain must be larger."""
    # along one column c with a prior of one, the gain of r = s c is s^2 |c|^4 / (|c|^2 + 1)
    column = np.eye(3)[:, :2]
    assert offered(column, np.sqrt(1.9 * LEAST_PREDICTED)) == []
    assert len(offered(column, np.sqrt(2.1 * LEAST_PREDICTED))) == 1
    assert len(offered(column, np.sqrt(4.0 * LEAST_PREDICTED_DAMPED))) > 1


def test_a_damped_step_must_differ_from_the_failed_one() -> None:
    """Damping changes a step along a flat valley, but not one of a well-conditioned problem."""
    residual = np.array([100.0, 0.0, 30.0])
    plain = list(steps(np.eye(3)[:, :2], residual, WEIGHTS, np.zeros(2), ANYWHERE, first=False))
    assert len(plain) < len(DAMPINGS)
    lengths = [float(np.linalg.norm(s)) for s in plain]
    assert lengths == sorted(lengths, reverse=True)
    valley = np.array([[1e4, 1e4], [0.0, 10.0], [0.0, 0.0]])
    along = list(
        steps(valley, np.array([0.0, 900.0, 0.0]), WEIGHTS, np.zeros(2), ANYWHERE, first=False)
    )
    assert len(along) == len(DAMPINGS)


def test_a_residual_is_complete_or_beyond_the_limit() -> None:
    """Below the limit the residual equals that computed alone; the limit includes the priors."""
    data = [recorded({}, kind, 5, 0.3) for kind in ("multisine", "steps")]
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), data)
    free = parameters.ordinary(knee_model())[:2]
    fitter.freeze(free, np.zeros(2))
    at = [np.zeros(2), np.array([3.0, -3.0])]
    residuals = [fitter.residual(free, a) for a in at]
    losses = [fitter.loss(free, a, r) for a, r in zip(at, residuals, strict=True)]
    assert losses[0] < losses[1]
    tried = list(fitter.within(free, at, losses[0]))
    assert tried[0] is not None
    np.testing.assert_array_equal(tried[0][0], residuals[0])
    assert tried[0][1] == pytest.approx(losses[0])
    assert tried[1] is None
    assert None not in list(fitter.within(free, at, losses[1] * (1.0 + 1e-9)))


def test_a_fit_at_its_minimum_reports_convergence() -> None:
    """A fit from its own minimum and Jacobian does not change any bit."""
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), [recorded({}, "multisine", 5, 0.5)])
    free = parameters.ordinary(knee_model())[:2]
    fitter.freeze(free, np.zeros(2))
    fit = fitter.fit(free, np.zeros(2), 8)
    again = fitter.fit(free, fit.at, 8, jacobian=fit.jacobian)
    assert again.converged
    assert again.chi2 == pytest.approx(fit.chi2, abs=LEAST_PREDICTED_DAMPED)


def test_the_loss_is_hubers_also_for_diverged_predictions() -> None:
    """Quadratic up to 3, linear beyond, and bounded for NaN."""
    plain = np.array([[0.5, -2.9], [4.0, -7.0], [np.nan, -np.inf]])
    sizes = np.array([0.5, 2.9, 4.0, 7.0, WORST, WORST])
    huber = np.where(sizes <= OUTLIER, sizes**2, 2.0 * OUTLIER * sizes - OUTLIER**2)
    assert tamed(plain) ** 2 == pytest.approx(huber)
    assert list(np.sign(tamed(plain))) == [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]
