"""Effects that are removed from the model, and places at which effects are rivals."""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.selection.progress import Search
from tests.identify.rig_data import INSTRUMENTS, knee_model

COORDINATES = {c.name: c for c in candidates(knee_model(), INSTRUMENTS)}


def test_effects_of_one_stage_and_errors_of_one_sensor_act_at_one_place() -> None:
    """A candidate at the place of the best one, or of a named effect, may be its rival."""

    def same(one: str, other: str) -> bool:
        return COORDINATES[one].stage == COORDINATES[other].stage

    assert same("pressure_a.offset", "pressure_a.gain_error")
    assert not same("pressure_a.offset", "pressure_b.offset")
    assert not same("pressure_a.offset", "load_spring")
    assert same("load_spring", "wall")
    assert not same("load_spring", "backlash")


def test_a_removed_effect_is_reported_with_the_reason() -> None:
    """The report states every removed name, and the model is without it."""
    effect = COORDINATES["supply_pressure.gain_error"]
    fit = Fit([effect], np.ones(1), np.zeros(10), np.ones((10, 1)), 0.0)
    search = Search([], effects=[effect], at=fit.at, final=fit)
    search.remove("supply_pressure.gain_error", "explains nothing")
    assert not search.effects
    assert not len(search.at)
    assert search.final is not None
    assert not search.final.coordinates
    assert search.dropped == {"supply_pressure.gain_error": "explains nothing"}
