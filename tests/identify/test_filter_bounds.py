"""The filter keeps its estimate of the seals' bend where bristles can be."""

import numpy as np

from hil_emulator.config.load import load
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from tests.identify.rig_data import CACHE
from tests.studies.generator.benches import AXIS
from tests.studies.generator.cases import campaign, case
from tests.studies.generator.sensors import CHANNELS

NEAR = {"valve_gain": 1.04, "valve_damping_ratio": 1.37, "land_leakage": 0.45,
        "viscous_friction": 0.28, "load_viscous_friction": -0.8}  # fmt: skip
"""Ordinary parameters of that machine, in standard deviations of what is believed of them."""


def test_a_large_step_does_not_lose_the_filter() -> None:
    """Corrections of 25 standard deviations, every 2 ms: friction never acts the wrong way.

    A bend that has been corrected far below what seals can bend makes friction push for a hundred
    samples; then a dead volume that is 3 % larger doubles the error.
    """
    steps = campaign(case("medium", 0, 2.0, AXIS))[0][1]
    model = PlantModel(load([AXIS.config]), CACHE)
    free = parameters.ordinary(model)
    fitter = Fitter(Observer(model, CHANNELS), [steps])
    errors = []
    for larger in (0.5, 0.8, 1.1):
        values = {**NEAR, "cylinder_dead_volume_a": larger}
        at = np.array([values.get(c.name, 0.0) for c in free])
        fitter.freeze(free, at)
        residual = fitter.residual(free, at)
        errors.append(float(residual @ residual))
    assert max(errors) < 1.1 * min(errors)


def test_the_deviance_is_infinite_where_the_filter_diverged() -> None:
    """A step to such a point is refused: its deviance is not better than any other."""
    model = PlantModel(load([AXIS.config]), CACHE)
    free = parameters.ordinary(model)
    fitter = Fitter(Observer(model, CHANNELS), [campaign(case("medium", 0, 0.5, AXIS))[0][1]])
    fitter.freeze(free, np.zeros(len(free)))
    assert np.isfinite(fitter.deviance(free, np.zeros(len(free))))
    fitter.frozen[0].gains.whitening[-1] = np.nan
    assert fitter.deviance(free, np.zeros(len(free))) == np.inf
