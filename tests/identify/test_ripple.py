"""Friction ripple along the stroke, simulated by another program and integrated out of a fit."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.estimation import ripple
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.reported_model import report_model
from hil_emulator.identify.estimation.ripple import Ripple, ripple_applies
from hil_emulator.identify.prediction.observer import windows
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from tests.identify.rig_data import CACHE, INSTRUMENTS
from tests.studies.generator.bench import record
from tests.studies.generator.benches import FIRST
from tests.studies.generator.plant import Machine

HIDDEN = {"stribeck_friction": 40.0, "position_friction": 0.4, "friction_asymmetry": -0.12}
"""Sizes of three laws of friction, SI."""

MODEL = PlantModel(load([FIRST.config]), CACHE)
KNOBS = [c for c in parameters.candidates(MODEL, INSTRUMENTS) if c.name in HIDDEN]
FREE = [*parameters.ordinary(MODEL), *KNOBS]
TRUE = np.array([HIDDEN[c.name] / c.scale for c in KNOBS])


def fitted(share: float) -> tuple[Fitter, Fit]:
    """Fit a machine with friction ripple of a relative size and a period of 3.7 mm."""
    sizes = {name.removesuffix("_friction"): size for name, size in HIDDEN.items()}
    sizes["position_friction"] = sizes.pop("position")
    real = Machine(**FIRST.sheet, ripple=share, foreign=False, **sizes)
    learn = [record(real, {}, kind, (7, i), 2.0, False)
             for i, kind in enumerate(("multisine", "triangles", "chirp"))]  # fmt: skip
    fitter, at = Fitter(Observer(MODEL, INSTRUMENTS), learn), np.zeros(len(FREE))
    at[-len(KNOBS) :] = TRUE
    for _ in range(2):
        fitter.freeze(FREE, at)
        fit = fitter.fit(FREE, at, 4)
        at = fit.at
    return fitter, fit


@pytest.fixture(scope="module")
def rippling() -> tuple[Fitter, Fit]:
    """Return a machine with three times the usual ripple."""
    return fitted(0.09)


@pytest.mark.slow
def test_the_estimated_ripple_has_its_true_size(rippling: tuple[Fitter, Fit]) -> None:
    """The standard deviation of a sine wave is its amplitude over the root of 2."""
    assert Ripple(*rippling).ratio == pytest.approx(0.09 / np.sqrt(2.0), rel=0.3)


def test_a_law_of_friction_does_not_absorb_ripple(rippling: tuple[Fitter, Fit]) -> None:
    """The error of the friction is within its uncertainty only if ripple is integrated out."""
    fitter, fit = rippling
    white = np.sqrt(np.diag(fit.covariance())[-len(KNOBS) :])
    final = report_model(fitter, fit, None, [])
    assert final is not None
    reported = np.array([final.deviations[c.name] for c in KNOBS])
    before, after = (f.at[-len(KNOBS) :] - TRUE for f in (fit, final.fit))
    print(f"off by {before / white} deviations, with ripple by {after / reported}")
    assert np.linalg.norm(before / white) > 6.0
    assert np.linalg.norm(after / reported) < 3.0


def test_estimates_of_a_correct_law_agree(rippling: tuple[Fitter, Fit]) -> None:
    """Effects independent of the position have equal estimates in all experiments."""
    final = report_model(*rippling, None, [])
    assert final is not None
    for name in ("stribeck_friction", "friction_asymmetry"):
        sizes = final.estimates[name]
        assert len(sizes.values) == 3
        assert sizes.between_experiments < 0.05 * abs(sizes.reported)


def test_correlation_does_not_increase_the_prior_variance(rippling: tuple[Fitter, Fit]) -> None:
    """Stops that the rod never reaches keep the uncertainty of their data sheet."""
    final = report_model(*rippling, None, [])
    assert final is not None
    assert final.deviations["end_stops"] == pytest.approx(1.0, abs=1e-3)
    white = np.sqrt(np.diag(final.fit.covariance()))
    for coordinate, deviation in zip(FREE[: -len(KNOBS)], white, strict=False):
        assert deviation <= final.deviations[coordinate.name] <= max(1.0, 3.0 * deviation)


@pytest.mark.slow
def test_without_ripple_nothing_changes() -> None:
    """The estimated ripple is zero, or so small that estimates hardly change."""
    fitter, fit = fitted(0.0)
    ripple = Ripple(fitter, fit)
    assert ripple.ratio < 0.01
    moved = np.abs(ripple.fit.at - fit.at) / np.sqrt(np.diag(fit.covariance()))
    assert np.max(moved) < 1.0


def test_pieces_give_the_same_as_the_whole(
    rippling: tuple[Fitter, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A long recording is processed in pieces."""
    fitter, fit = rippling
    whole = Ripple(fitter, fit)
    monkeypatch.setattr(windows, "LONGEST", 700)
    pieces = Ripple(fitter, fit)
    assert pieces.ratio == pytest.approx(whole.ratio, rel=0.02)
    spread = np.sqrt(np.diag(whole.fit.covariance()))
    assert np.max(np.abs(pieces.fit.at - whole.fit.at) / spread) < 0.1
    left = np.concatenate([one.residual for one in pieces.profiled([])])
    assert left @ left == pytest.approx(fit.residual @ fit.residual, rel=0.2)


@pytest.mark.slow
def test_a_shortened_step_does_not_change_the_experiments_estimates(
    rippling: tuple[Fitter, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The mean of the experiments' estimates does not depend on the step of the value."""
    fitter, fit = rippling
    wanted = []
    for part in (1.0, 0.5):
        monkeypatch.setattr(ripple, "PARTS", (part,))
        final = report_model(fitter, fit, None, [])
        assert final is not None
        for name, sizes in final.estimates.items():
            mean = np.average(sizes.values, weights=1.0 / np.array(sizes.variances))
            wanted.append(mean / final.deviations[name])
    whole, half = np.reshape(wanted, (2, -1))
    np.testing.assert_allclose(whole, half, atol=0.3)


def test_without_a_known_position_there_is_no_ripple(rippling: tuple[Fitter, Fit]) -> None:
    """Nor with estimated noise, which includes ripple, or without a valid sample."""
    fitter, fit = rippling
    assert ripple_applies(fitter, fit)
    assert not ripple_applies(fitter, replace(fit, effective=100.0))
    assert not ripple_applies(fitter, replace(fit, residual=0.0 * fit.residual))
    blind = [replace(e, readings={k: v for k, v in e.readings.items() if k != "position"})
             for e in fitter.experiments]  # fmt: skip
    assert not ripple_applies(Fitter(Observer(MODEL, INSTRUMENTS), blind), fit)
