"""Residuals with another sensor, carried along the run, compared with the prediction."""

from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.estimation.finite_difference import FINITE
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.scan import scan
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

HIDDEN = 1e-4
"""Change of the residuals that no fit sees, in standard deviations of the noise."""

SMALL = 1e-2
"""Part of the size at which a sensor is screened, where its effect is linear."""

ORDINARY = parameters.ordinary(knee_model())
SENSORS = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS) if c.channel}


@cache
def fitter() -> Fitter:
    """Return a fitter with a healthy machine and a gap in a channel."""
    data = recorded({}, "multisine", 3, 0.5)
    data.readings["load_force"][100:120] = np.nan
    healthy = Fitter(Observer(knee_model(), INSTRUMENTS), [data])
    healthy.freeze(ORDINARY, np.zeros(len(ORDINARY)))
    return healthy


def changes(sensor: Coordinate) -> tuple[np.ndarray, np.ndarray]:
    """Return how a small effect of a sensor changes the residuals: carried along, and predicted."""
    free = [*ORDINARY, sensor]
    base, moved = np.zeros(len(free)), np.zeros(len(free))
    moved[-1] = np.clip(SMALL * (1.0 if sensor.inverse else FINITE), *sensor.bounds)
    points = [knee_model().memory(free, at) for at in (base, moved)]
    healthy = fitter().residual(free, base)
    carried = next(fitter().batch.with_other_sensors(points[0], points[1:]))
    return carried - healthy, fitter().residual(free, moved) - healthy


@pytest.mark.parametrize("name", SENSORS)
def test_another_sensor_changes_the_residual_as_predicted(name: str) -> None:
    """Every effect of a sensor, along a run with missing data."""
    carried, predicted = changes(SENSORS[name])
    assert np.linalg.norm(carried - predicted) <= max(0.05 * np.linalg.norm(predicted), HIDDEN)


def test_what_explains_much_is_predicted() -> None:
    """A sensor that is off by its typical size has the score of the prediction itself."""
    offset, bias = SENSORS["pressure_a.offset"], SENSORS["load_force.offset"]
    data = recorded({}, "multisine", 3, 0.5)
    data.readings["pressure_a"] += offset.scale
    offset_fitter = Fitter(Observer(knee_model(), INSTRUMENTS), [data])
    free = ORDINARY[:2]
    offset_fitter.freeze(free, np.zeros(2))
    base = offset_fitter.fit(free, np.zeros(2), 2)
    scores = scan(offset_fitter, base, [bias, offset])
    alone = offset_fitter.column([*free, offset], np.append(base.at, 0.0), base.residual, 2)
    assert scores[0].coordinate is offset
    np.testing.assert_array_equal(scores[0].sensitivity, alone.astype(np.float32))
    assert len(scores) == 2
