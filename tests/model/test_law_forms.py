"""Published forms of the base laws that differ from the model's."""

import numpy as np
import pytest

from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.law_forms import FORMS, USUAL, since_reversal

PLANT = {"valve_natural_frequency": 250.0}


def test_the_way_since_a_reversal_restarts_with_each() -> None:
    """It grows with the way from the last turning point, and is zero there."""
    time = np.linspace(0.0, 1.0, 401)
    position, velocity = -np.cos(2.0 * np.pi * time), np.sin(2.0 * np.pi * time)
    way = since_reversal(position, velocity)
    assert way[100] == pytest.approx(1.0, abs=0.02)
    assert way[199] == pytest.approx(2.0, abs=0.02)
    assert way[202] == pytest.approx(0.0, abs=0.02)
    assert way[300] == pytest.approx(1.0, abs=0.02)


def test_usual_effects_are_of_the_catalogue() -> None:
    """Each effect that every machine has a little of is declared, and its usual size is allowed."""
    catalogue = {e.name: e for e in CATALOGUE}
    for usual in USUAL:
        knob = catalogue[usual.name].knob
        assert knob.allows(usual.size(PLANT))
        assert usual.size(PLANT) != knob.off


def test_every_law_states_its_source() -> None:
    """Every law with forms that differ states their source."""
    assert all(form.source and form.law for form in FORMS)
