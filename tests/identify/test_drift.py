"""Drift of the valve's null, which every machine has and no effect may stand for."""

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from tests.identify.rig_data import CACHE, KNEE
from tests.studies.generator.bench import record
from tests.studies.generator.cases import case, machine

CHANNELS = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")


@pytest.mark.parametrize(("effect", "value"), [("transport_delay", 1.6), ("hysteresis", 1.0)])
def test_the_null_is_tracked_behind_what_holds_the_set_point(effect: str, value: float) -> None:
    """The filter corrects the null as much with a delay or a hysteresis as without."""
    model = PlantModel(load([KNEE]), CACHE)
    observer = Observer(model, CHANNELS)
    experiment = record(machine(case("none", 0, 0.5)), {}, "multisine", (1, 1), 0.5, False)
    hidden = next(c for c in candidates(model, CHANNELS) if c.name == effect)
    null = -2
    frozen = [observer.freeze(experiment, *model.memory([hidden], [at])) for at in (0.0, value)]
    plain, moved = (np.abs(f.gains.kalman[300:, null]).sum() for f in frozen)
    assert moved > 0.5 * plain
