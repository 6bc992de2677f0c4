"""Effects that every machine has to some extent."""

from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.law_forms import USUAL

PLANT = {"valve_natural_frequency": 250.0}


def test_usual_effects_are_of_the_catalogue() -> None:
    """Each is declared, its usual size is allowed, and its law and source are stated."""
    catalogue = {e.name: e for e in CATALOGUE}
    for usual in USUAL:
        knob = catalogue[usual.name].knob
        assert knob.allows(usual.size(PLANT))
        assert usual.size(PLANT) != knob.off
        assert usual.law
        assert usual.source
