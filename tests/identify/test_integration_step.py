"""Influence of the integration step of a prediction on effects."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.integration_steps import CAREFUL_STEP, LARGEST_STEP
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.stages import element
from tests.identify.rig_data import CACHE, INSTRUMENTS, knee, knee_model, recorded

FINE = 2e-5
"""Step of the emulator itself [s]."""

SEEN = 1.0
"""Norm of what an effect does, in standard deviations of the noise, below which it does nothing."""

ORDINARY = parameters.ordinary(knee_model())
FILTERS = [e for e in knee_model().effects if e.stage is element]
CANDIDATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}
EFFECTS = [name for name, c in CANDIDATES.items() if not c.channel or c.effect in FILTERS]


@cache
def fitter(step: float) -> Fitter:
    """Return a healthy machine, predicted with a largest step [s]."""
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS, step), [recorded({}, "multisine", 3, 0.5)])
    fitter.freeze(ORDINARY, np.zeros(len(ORDINARY)))
    return fitter


def test_a_fast_machine_gets_careful_steps() -> None:
    """A valve with twice the bandwidth, or the flux of a torque motor, needs smaller steps."""
    model = knee_model()
    usual = Observer(model, INSTRUMENTS)
    assert usual.steps.width(model.par) == LARGEST_STEP
    loop, _ = model.memory([CANDIDATES["hysteresis"]], [1.0])
    assert usual.steps.width(loop) == CAREFUL_STEP
    fast = replace(knee(), plant=knee().plant | {"valve_natural_frequency": 560.0})
    quick = PlantModel(fast, CACHE)
    assert Observer(quick, INSTRUMENTS).steps.width(quick.par) == CAREFUL_STEP


def done(name: str, step: float) -> np.ndarray:
    """Return the change of the residuals by an effect at its typical size."""
    free, at = [*ORDINARY, CANDIDATES[name]], np.zeros(len(ORDINARY) + 1)
    healthy = fitter(step).residual(free, at)
    at[-1] = np.clip(1.0, *CANDIDATES[name].bounds)
    return fitter(step).residual(free, at) - healthy


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_does_not_depend_on_the_step_of_a_prediction(name: str) -> None:
    """The change of the residuals is that with the emulator's own step."""
    fine = done(name, FINE)
    if np.linalg.norm(fine) > SEEN:
        coarse = done(name, LARGEST_STEP)
        assert fine @ coarse == pytest.approx(fine @ fine, rel=0.02)
        assert np.linalg.norm(coarse - fine) < 0.1 * np.linalg.norm(fine)
