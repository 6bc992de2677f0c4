"""Two clocks are found by lags that grow; the phase that friction turns is no lag."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.data_checks.clocks import two_clocks
from hil_emulator.identify.data_checks.plausible import hydraulic_force
from hil_emulator.identify.experiment_design.practice import campaign, ground, hide
from hil_emulator.identify.measured.experiment import Experiment
from tests.identify.rig_data import knee_model

KINDS = ("multisine", "steps", "triangles", "chirp", "pseudo_random")


@cache
def practice() -> tuple[Experiment, ...]:
    """Return practice experiments of 8.57 s, with a leakage hidden in them."""
    model = knee_model()
    return tuple(
        campaign(ground(model, [hide(model, "internal_leakage", "medium")], 1), KINDS, 8.57)
    )


def found(e: Experiment) -> list[str]:
    """Return what tells of two clocks."""
    return two_clocks([e], lambda e: hydraulic_force(e, knee_model().plant_values))


def undriven(e: Experiment) -> Experiment:
    """Return an experiment without its valve current."""
    return replace(e, current=np.zeros(0))


def drifting(e: Experiment, *names: str) -> Experiment:
    """Return channels that another logger took with a clock one percent faster."""
    t = np.arange(e.samples) * e.period
    late = {n: np.interp(1.01 * t, t, e.readings[n]) for n in names}
    return replace(e, readings=e.readings | late)


@pytest.mark.parametrize("number", range(len(KINDS)), ids=KINDS)
def test_practice_data_have_one_clock(number: int) -> None:
    """No experiment is refused, with or without its valve current.

    Nor is a chirp, in which frequency, and with it the phase of friction, grows all the time.
    """
    e = practice()[number]
    assert found(e) == []
    assert found(undriven(e)) == []


@pytest.mark.parametrize("names", [("position",), ("load_force",),
                                   ("pressure_a", "pressure_b", "supply_pressure")])  # fmt: skip
def test_a_logger_with_a_faster_clock_is_found(names: tuple[str, ...]) -> None:
    """One percent of drift is found in broad motion, whichever quantity drifts."""
    for e in (practice()[0], practice()[2], practice()[4]):
        for one in (e, undriven(e)):
            assert "two clocks" in " ".join(found(drifting(one, *names))), (e.name, names)
