"""Differences of base laws, integrated out of the residuals."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.conclusion.other_forms import other_forms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer import observer
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.parallel.pool import frozen_at, residual
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.residuals.integrated_out import integrated_out
from tests.identify.rig_data import INSTRUMENTS, OFF, knee_model, recorded


def test_rows_are_multiplied_by_the_inverse_root_of_the_covariance() -> None:
    """Rows are multiplied by (I + X X')^(-1/2), computed here from the whole covariance.

    A residual orthogonal to all differences is not changed.
    """
    random = np.random.default_rng(1)
    x = random.normal(size=(3, 40)) * np.array([[0.1], [3.0], [50.0]])
    rows = random.normal(size=(5, 40))
    powers, vectors = np.linalg.eigh(np.eye(40) + x.T @ x)
    whole = rows @ (vectors * powers**-0.5) @ vectors.T
    np.testing.assert_allclose(integrated_out(x).of(rows), whole, atol=1e-9)
    apart = rows - rows @ np.linalg.pinv(x) @ x
    np.testing.assert_allclose(integrated_out(x).of(apart), apart, atol=1e-9)
    assert integrated_out(x).log_determinant == pytest.approx(float(np.sum(np.log(powers))))


def test_a_column_that_is_not_finite_changes_nothing() -> None:
    """A difference with a diverged run has no influence."""
    rows = np.ones((1, 10))
    nothing = integrated_out(np.full((2, 10), np.nan))
    np.testing.assert_array_equal(nothing.of(rows), rows)


def test_an_oil_that_stiffens_with_pressure_is_not_a_misfit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A usual rise of the modulus with pressure leaves less than half of its error.

    More than half of the error of a null bias stays.
    """
    # all residuals by the same weights
    monkeypatch.setattr(observer, "REWEIGHED", 0)
    model = knee_model()
    predictor = Observer(model, INSTRUMENTS)
    point = model.par, model.chan
    for changes, most, least in (
        ({"modulus_pressure_rise": 10.0}, 0.5, 0.0), ({"null_bias_bias": 5e-5}, 1.0, 0.5),
    ):  # fmt: skip
        experiment = recorded(changes, "waves", 3, 1.0)
        sound = recorded({}, "waves", 3, 1.0)
        excess = []
        for allowed in (False, True):
            sums = []
            for e in (experiment, sound):
                frozen = frozen_at(predictor, e, point)
                frozen = frozen if allowed else replace(frozen, forms=None)
                sums.append(float(np.sum(residual(predictor, frozen, point) ** 2)))
            excess.append(sums[0] - sums[1])
        assert least * excess[0] <= excess[1] <= most * excess[0]


@pytest.mark.parametrize(("rise", "reported"), [(0.0, False), (40.0, True)])
def test_a_law_of_another_form_is_reported(rise: float, reported: bool) -> None:
    """The stiffening of the oil is reported as the law that differs."""
    model = knee_model()
    predictor = Observer(model, INSTRUMENTS)
    fitter = Fitter(predictor, [recorded({"modulus_pressure_rise": rise}, "steps", 3, 1.0)])
    free = [c for c in parameters.ordinary(model) if c.field in OFF]
    fitter.freeze(free, np.zeros(len(free)))
    fit = fitter.fit(free, np.zeros(len(free)), 6)
    notes = other_forms(predictor, fitter.frozen, fit)
    law = "stiffness of the oil: this law has another form"
    assert any(note.startswith(law) for note in notes) == reported
