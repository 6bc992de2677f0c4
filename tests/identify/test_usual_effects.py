"""Effects that every machine has to some extent, fitted like ordinary parameters."""

import numpy as np
import pytest

from hil_emulator.identify.conclusion.other_forms import other_forms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.experiment_design import practice
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.search import Searcher
from tests.identify.rig_data import INSTRUMENTS, OFF, knee_model, recorded


@pytest.mark.parametrize("rise", [0.0, 12.0])
def test_an_oil_that_stiffens_with_pressure_is_reported(rise: float) -> None:
    """The rise of the modulus is fitted, and named as the form of the law, if there is one."""
    model = knee_model()
    predictor = Observer(model, INSTRUMENTS)
    fitter = Fitter(predictor, [recorded({"modulus_pressure_rise": rise}, "steps", 3, 1.0)])
    free = [c for c in parameters.ordinary(model) if c.field in OFF] + parameters.usual(model)
    fitter.freeze(free, np.zeros(len(free)))
    fit = fitter.fit(free, np.zeros(len(free)), 6)
    fitted = next(c.value(at) for c, at in zip(free, fit.at, strict=True)
                  if c.name == "modulus_pressure")  # fmt: skip
    assert fitted == pytest.approx(rise, abs=3.0)
    notes = other_forms(fit)
    law = "stiffness of the oil: this law has another form"
    assert any(note.startswith(law) for note in notes) == (rise > 0.0)


@pytest.mark.parametrize(
    ("size", "named"), [(2e-4, False), pytest.param(2e-3, True, marks=pytest.mark.slow)]
)
def test_an_effect_larger_than_usual_is_a_candidate(size: float, named: bool) -> None:
    """A driver lags by 0.2 ms on every machine; a lag of 2 ms may be named."""
    model = knee_model()
    predictor = Observer(model, INSTRUMENTS)
    logs = [
        recorded({"driver_lag_time_constant": size}, kind, 3, 1.0) for kind in ("steps", "waves")
    ]
    nuisances = parameters.ordinary(model) + parameters.usual(model)
    effects = parameters.candidates(model, INSTRUMENTS)
    search = Searcher(predictor, logs, [], effects, nuisances).look()
    assert ("driver_lag" in [c.name for c in search.nuisances]) != named


def test_a_lag_too_short_to_be_seen_is_none() -> None:
    """Below the least lag, the nearer one of zero and the least lag is fitted."""
    lag = next(c for c in parameters.usual(knee_model()) if c.name == "driver_lag")
    least = lag.least / lag.scale
    assert [lag.value(share * least) for share in (0.0, 0.4, 0.6, 1.0)] == [
        0.0, 0.0, pytest.approx(lag.least), pytest.approx(lag.least),
    ]  # fmt: skip
    assert lag.value(2.0 * least) == pytest.approx(2.0 * lag.least)


def test_the_first_fit_of_a_fitter_does_not_stop_at_its_start() -> None:
    """The first derivatives may be too coarse for any step; then they are computed once more."""
    model = knee_model()
    free = [c for c in parameters.ordinary(model) if c.name.startswith("valve_")]
    free += [c for c in parameters.usual(model) if c.name == "driver_lag"]
    logs = practice.campaign(practice.ground(model, (), 12), practice.TRAINING[:1], 1.0)
    fitter = Fitter(Observer(model, INSTRUMENTS), logs)
    start = np.array([free[-1].least / free[-1].scale if c is free[-1] else 0.0 for c in free])
    fitter.freeze(free, start)
    before = fitter.loss(free, start, fitter.residual(free, start))
    assert fitter.fit(free, start, 1).chi2 < 0.5 * before
