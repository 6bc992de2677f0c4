"""What comes again whenever the rod is in the same state is no noise, and nobody calls it so."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.commands.identify import summary
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import EVERYTHING, Question, identify
from tests.identify.rig_data import CACHE, knee, recorded

KEPT = ("pressure_a", "pressure_b", "position", "load_force")
ASYMMETRIC = {"friction_asymmetry_asymmetry": 0.15}
NOISE = 16.7
"""Standard deviation of the load cell's noise in the configuration [N]."""
KINDS = ("multisine", "triangles", "steps")
GAP = Question(search=False)


def force_balance(changes: Mapping[str, float], kind: str) -> Experiment:
    """Return a run of which time, pressures, position and load force were kept."""
    run = recorded(changes, kind, seed=1)
    return replace(run, current=np.zeros(0), readings={n: run.readings[n] for n in KEPT})


def examined(changes: Mapping[str, float], kind: str, question: Question = EVERYTHING) -> Result:
    """Return what is said of one such run."""
    return identify(knee(), [force_balance(changes, kind)], question=question, cache=CACHE)


@pytest.mark.parametrize("kind", KINDS)
def test_what_an_effect_closes_is_no_noise(kind: str) -> None:
    """Friction that differs by 15 % with direction is named, beside what looks alike at most.

    At the two speeds of triangles a load cell with an offset does: then both are told.
    """
    (found,) = examined(ASYMMETRIC, kind).effects
    told = {found.name, *found.group}
    assert "friction_asymmetry" in told
    assert told <= {"friction_asymmetry", "load_force.offset"}
    assert kind == "triangles" or told == {"friction_asymmetry"}
    assert found.name != "friction_asymmetry" or found.value == pytest.approx(0.15, abs=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_what_no_effect_explains_is_not_nothing(kind: str) -> None:
    """Without it in the catalogue twice the noise remains, and the verdict says so."""
    result = examined(ASYMMETRIC, kind, Question(only=["stribeck_friction", "position_friction"]))
    assert result.repeats is not None
    assert result.repeats.rms > 1.5 * NOISE
    assert not result.effects
    assert result.verdict == "cannot_tell"
    assert f"{result.repeats.rms:.3g} N rms" in result.reason
    assert "comes again" in result.reason
    assert result.reason in summary(result)


@pytest.mark.parametrize("kind", KINDS)
def test_noise_alone_is_nothing(kind: str) -> None:
    """Without it the load cell's noise is all that remains, and nothing is missing."""
    result = examined({}, kind)
    assert result.repeats is not None
    assert result.repeats.rms == pytest.approx(NOISE, rel=0.1)
    assert result.verdict == "nothing_missing"


def test_a_gap_that_comes_again_is_no_agreement() -> None:
    """Without a search, too: the model agrees only where noise is all that remains."""
    assert examined(ASYMMETRIC, "triangles", GAP).verdict in ("cannot_tell", "disagrees")
    assert examined({}, "triangles", GAP).verdict == "agrees"
