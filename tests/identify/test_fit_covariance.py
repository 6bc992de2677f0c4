"""Covariance of the coordinates of a fit."""

import math
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import knee_model


def fit(jacobian: Array, prior: float = math.inf) -> Fit:
    """Return a fit with a Jacobian."""
    free = [replace(c, prior=prior) for c in parameters.ordinary(knee_model())]
    count = jacobian.shape[1]
    return Fit(free[:count], np.zeros(count), np.zeros(len(jacobian)), jacobian, 0.0)


def test_nearly_collinear_columns_have_the_variance_of_their_difference() -> None:
    """Columns e + d and e - d with orthogonal e and d have the variance (1/|e|² + 1/|d|²)/4.

    It is exact for a lean fit, too, although single precision would lose |d|² in sums of |e|².
    """
    random = np.random.default_rng(1)
    basis, _ = np.linalg.qr(random.standard_normal((20_000, 2)))
    e, d = 1e3 * basis[:, 0], 0.1 * basis[:, 1]
    exact = 0.25 * (1.0 / (e @ e) + 1.0 / (d @ d))
    whole = fit(np.column_stack([e + d, e - d]))
    for one, tolerance in ((whole, 1e-6), (whole.lean(), 0.01)):
        np.testing.assert_allclose(np.diag(one.covariance()), exact, rtol=tolerance)


def test_no_variance_is_negative() -> None:
    """Directions without information are left out, for equal columns and a zero column."""
    random = np.random.default_rng(2)
    column = random.standard_normal(5_000)
    for jacobian in (
        np.column_stack([column, column, 0.0 * column]),
        np.column_stack([1e5 * column, 1e5 * column * (1.0 + 1e-15), column]),
    ):
        for one in (fit(jacobian), fit(jacobian).lean()):
            assert (np.diag(one.covariance()) >= 0.0).all()


def test_a_prior_bounds_parameters_that_data_do_not_determine() -> None:
    """A column of zeros leaves the prior's variance; a column j adds j² to 1/prior²."""
    jacobian = np.column_stack([np.full(4, 3.0), np.zeros(4)])
    np.testing.assert_allclose(
        np.diag(fit(jacobian, prior=0.5).covariance()), [1.0 / (36.0 + 4.0), 0.25]
    )
