"""Two clocks are found by lags that grow; the phase that friction turns is no lag."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.data_checks.clocks import two_clocks
from hil_emulator.identify.data_checks.plausible import contradictions, hydraulic_force
from hil_emulator.identify.experiment_design.practice import campaign, ground, hide
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.resonance import on_oil
from tests.identify.rig_data import CACHE, knee_model
from tests.studies.generator.benches import CRANE
from tests.studies.generator.cases import cases_called, recording

KINDS = ("multisine", "steps", "triangles", "chirp", "pseudo_random")


@cache
def practice() -> tuple[Experiment, ...]:
    """Return practice experiments of 8.57 s, with a leakage hidden in them."""
    model = knee_model()
    return tuple(
        campaign(ground(model, [hide(model, "internal_leakage", "medium")], 1), KINDS, 8.57)
    )


def messages(e: Experiment, frequency: float | None = None) -> list[str]:
    """Return the messages on two clocks, with the natural frequency of the machine."""
    plant = knee_model().plant_values
    natural = on_oil(plant) if frequency is None else frequency
    return two_clocks([e], lambda e: hydraulic_force(e, plant), natural)


@cache
def crane() -> PlantModel:
    """Return the third machine of the blind test."""
    return PlantModel(load([CRANE.config]), CACHE)


def undriven(e: Experiment) -> Experiment:
    """Return an experiment without its valve current."""
    return replace(e, current=np.zeros(0))


def drifting(e: Experiment, *names: str, faster: float = 0.01) -> Experiment:
    """Return channels that another logger took with a clock one percent faster, or by more."""
    t = np.arange(e.samples) * e.period
    late = {n: np.interp((1.0 + faster) * t, t, e.readings[n]) for n in names}
    return replace(e, readings=e.readings | late)


@pytest.mark.parametrize("number", range(len(KINDS)), ids=KINDS)
def test_practice_data_have_one_clock(number: int) -> None:
    """No experiment is refused, with or without its valve current.

    Nor is a chirp, in which frequency, and with it the phase of friction, grows all the time.
    """
    e = practice()[number]
    assert messages(e) == []
    assert messages(undriven(e)) == []


SWINGING = [
    pytest.param("none-509", "slow", marks=pytest.mark.slow), ("medium-500", "slow"),
    ("medium-501", "fast"), ("medium-509", "chirp"),
]  # fmt: skip
"""A mass of eight tons that swings at 9 Hz: noise hides its acceleration, a chirp passes its
resonance, and its speed turns against the current."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), SWINGING)
def test_a_machine_that_swings_slowly_has_one_clock(name: str, kind: str) -> None:
    """Its own lags are as long as its period: they change with the motion, and seem to drift."""
    [which] = cases_called(f"{name}@crane", 2.0)
    assert contradictions([recording(which, kind)], crane().plant_values) == []


@pytest.mark.parametrize(("name", "faster"), [("position", 0.02), ("load_force", 0.01)])
def test_a_faster_clock_is_found_on_such_a_machine_as_well(name: str, faster: float) -> None:
    """In 12 s the clock drifts by more than the period of the machine."""
    [which] = cases_called("none-500@crane", 2.0)
    late = drifting(recording(which, "multisine"), name, faster=faster)
    assert "two clocks" in " ".join(contradictions([late], crane().plant_values))


@pytest.mark.parametrize(("frequency", "reported"), [(np.nan, True), (1e3, True), (1.0, False)])
def test_what_swings_slowly_may_be_as_late_as_that(frequency: float, reported: bool) -> None:
    """A drift of 86 ms is no machine's unless it swings once a second; unknown is quick."""
    late = drifting(undriven(practice()[0]), "position")
    assert bool(messages(late, frequency)) == reported


@pytest.mark.parametrize("names", [("position",), ("load_force",),
                                   ("pressure_a", "pressure_b", "supply_pressure")])  # fmt: skip
def test_a_logger_with_a_faster_clock_is_found(names: tuple[str, ...]) -> None:
    """One percent of drift is found in broad motion, whichever quantity drifts."""
    for e in (practice()[0], practice()[2], practice()[4]):
        for one in (e, undriven(e)):
            assert "two clocks" in " ".join(messages(drifting(one, *names))), (e.name, names)
