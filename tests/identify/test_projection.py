"""Projection of columns, compared with least squares."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.scan import ROWS_AT_ONCE, pairs_of, score_of
from tests.identify.rig_data import INSTRUMENTS, knee_model

ROWS = ROWS_AT_ONCE + 100
FREE = parameters.ordinary(knee_model())[:3]
CANDIDATES = parameters.candidates(knee_model(), INSTRUMENTS)


@pytest.fixture
def fit() -> Fit:
    """Return a fit of three parameters with priors, anywhere."""
    random = np.random.default_rng(2)
    jacobian = random.normal(size=(ROWS, 3))
    return Fit(list(FREE), random.normal(size=3), random.normal(size=ROWS), jacobian, 0.0)


def test_projected_columns_are_residuals_of_least_squares(fit: Fit) -> None:
    """Each projected column is the residual of a fit of all parameters with their priors."""
    columns = np.random.default_rng(3).normal(size=(ROWS, 4))
    projected, responses = Projection(fit).together(columns)
    stacked = np.vstack([fit.jacobian, np.diag([1.0 / c.prior for c in FREE])])
    for i, column in enumerate(columns.T):
        padded = np.append(column, np.zeros(3))
        response = np.linalg.lstsq(stacked, -padded, rcond=None)[0]
        assert responses[:, i] == pytest.approx(response, abs=1e-9)
        assert projected[:, i] == pytest.approx(padded + stacked @ response, abs=1e-9)


def test_a_pair_gains_what_least_squares_gain_with_both(fit: Fit) -> None:
    """For two effects that cancel each other, and one that explains more than either alone."""
    random = np.random.default_rng(4)
    one, third = random.normal(size=(2, ROWS))
    other = -0.9 * one + 0.3 * random.normal(size=ROWS)
    residual = random.normal(size=ROWS) - 3.0 * (one + other) - 0.4 * third
    mixed = replace(fit, at=np.zeros(3), residual=residual)
    project = Projection(mixed)
    able = [c for c in CANDIDATES if c.bounds[0] < -5.0 and c.bounds[1] > 5.0][:3]
    scores = [score_of(c, column, project) for c, column in zip(able, (one, other, third),
                                                                strict=True)]  # fmt: skip
    pair = pairs_of(scores, mixed)[0]
    assert [s.coordinate for s in pair.scores] == able[:2]
    both = np.column_stack([s.column for s in pair.scores]).astype(np.float64)
    sizes = np.linalg.lstsq(both, -project.residual, rcond=None)[0]
    left = project.residual + both @ sizes
    gained = float(project.residual @ project.residual - left @ left)
    assert pair.delta_chi2 == pytest.approx(gained, rel=1e-3)
    assert pair.sizes == pytest.approx(sizes, rel=1e-3)
