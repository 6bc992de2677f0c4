"""A residual that recurs in the same state of the rod is not reported as noise."""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from hil_emulator.commands.identify import summary
from hil_emulator.identify.conclusion.conclude import conclude_repeated
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.disagreement.repeatability import Repeatability
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.session import EVERYTHING, Question, identify
from tests.identify.rig_data import CACHE, knee, knee_model, recorded

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
    """Return the result of one such run."""
    return identify(knee(), [force_balance(changes, kind)], question=question, cache=CACHE)


@pytest.mark.parametrize("kind", KINDS)
def test_what_an_effect_closes_is_no_noise(kind: str) -> None:
    """Friction that differs by 15 % with direction is named, alone or with its rival.

    At the two speeds of triangles an offset of the load cell is a rival: then both are reported.
    """
    (finding,) = examined(ASYMMETRIC, kind).effects
    reported = {finding.name, *finding.group}
    assert "friction_asymmetry" in reported
    assert reported <= {"friction_asymmetry", "load_force.offset"}
    assert kind == "triangles" or reported == {"friction_asymmetry"}
    assert finding.name != "friction_asymmetry" or finding.value == pytest.approx(0.15, abs=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_what_no_effect_explains_is_not_nothing(kind: str) -> None:
    """Without the effect twice the noise remains, and the data do not decide."""
    result = examined(ASYMMETRIC, kind, Question(only=["stribeck_friction", "position_friction"]))
    assert result.repeats is not None
    assert result.repeats.rms > 1.5 * NOISE
    assert not result.effects
    assert result.verdict == "cannot_tell"
    assert f"{result.repeats.rms:.3g} N rms" in result.reason
    assert "recurs in the same state" in result.reason
    assert "an effect that is not in the catalogue and an error of the sensor" in result.reason
    assert result.next_experiment.endswith("record the load force with a second sensor as well")
    assert result.reason in summary(result)


def test_the_two_likeliest_candidates_are_separated_by_what_one_of_them_depends_on() -> None:
    """Stribeck friction depends on the speed, friction along the stroke on the position as well."""
    named = [c for c in parameters.candidates(knee_model(), KEPT)
             if c.name in ("stribeck_friction", "position_friction")]  # fmt: skip
    scores = [SimpleNamespace(coordinate=c, visible=True) for c in named]
    search = Search([], rounds=[cast("Round", SimpleNamespace(trials=[], scores=scores))])
    result = Result("nothing_missing", "")
    conclude_repeated(result, Repeatability("load_force", 30.0, 10.0, 300.0, "N"), search)
    assert result.verdict == "cannot_tell"
    first, second = (c.name for c in named)
    assert result.reason.endswith(f"the likeliest explanations are {first} and {second}")
    assert result.next_experiment == (
        f"to separate {first} from {second}, record "
        "at other speeds, slower and faster and over the whole stroke"
    )


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
