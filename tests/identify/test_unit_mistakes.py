"""A channel in a unit other than that of its heading is named if another channel shows it."""

from dataclasses import replace

import pytest

from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.measured.experiment import Experiment
from tests.identify.rig_data import knee_model, recorded


def message(e: Experiment) -> str:
    """Return what contradicts."""
    return "; ".join(contradictions([e], knee_model().plant_values))


def scaled(factor: float, *names: str) -> Experiment:
    """Return an experiment with some channels off by a factor."""
    e = recorded({}, "multisine", 1)
    return replace(e, readings=e.readings | {n: factor * e.readings[n] for n in names})


PRESSURES = ("pressure_a", "pressure_b", "supply_pressure")


@pytest.mark.parametrize(("factor", "names", "words"), [
    (9.80665, ("load_force",), "load_force looks as if N had been read as kgf"),
    (1000.0, ("load_force",), "load_force looks as if N had been read as kN"),
    (0.1, ("pressure_a",), "pressure_a looks as if MPa had been read as bar"),
    (0.01, ("pressure_b",), "pressure_b looks as if bar had been read as kPa"),
    (0.1, PRESSURES, "as if MPa had been read as bar"),
    (14.504, PRESSURES, "as if psi had been read as bar"),
    (100.0, PRESSURES, "as if kPa had been read as bar"),
    (10.0, ("supply_pressure",), "as if bar had been read as MPa"),
    (1000.0, ("position",), "as if mm had been read as m"),
])  # fmt: skip
def test_the_likely_mistake_is_named(factor: float, names: tuple[str, ...], words: str) -> None:
    """Forces against pressures, pressures against the supply, position against the stroke."""
    assert words in message(scaled(factor, *names))


def test_a_set_point_in_other_units_is_refused() -> None:
    """Current against the speed that it causes, and against what the valve takes."""
    e = recorded({}, "multisine", 1)
    for factor in (1e-3, 1e3):
        assert "valve_current" in message(replace(e, current=factor * e.current))


def test_without_evidence_there_is_no_message() -> None:
    """Sound data; and a position ten times too small is a motion like any other."""
    assert message(scaled(1.0)) == ""
    assert message(scaled(0.1, "position")) == ""
