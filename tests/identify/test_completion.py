"""Rivals that complete the law of a named effect, and are no further effect."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.prediction.parameters import candidates
from hil_emulator.identify.selection.evidence import Evidence, Trial
from hil_emulator.identify.selection.law_between import completions
from hil_emulator.identify.selection.law_form import judge
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Score
from tests.identify.rig_data import INSTRUMENTS, knee_model

COORDINATES = {c.name: c for c in candidates(knee_model(), INSTRUMENTS)}


def trial(name: str, delta_chi2: float, needed: float = 20.0) -> Trial:
    """Return a refitted candidate with such a gain."""
    c = COORDINATES[name]
    none = np.zeros(0)
    fit = Fit([c], np.ones(1), none, np.zeros((0, 1)), 0.0)
    score = Score(c, delta_chi2, 1.0, 1.0, none, none, none)
    return Trial(score, fit, Evidence(delta_chi2, delta_chi2, delta_chi2, needed, delta_chi2), 1.0)


NAMED = [trial("threshold", 40000.0), trial("hysteresis", 33000.0), trial("null_bias", 19000.0)]
"""Of the round in which a threshold was named."""


@pytest.mark.parametrize("before", [33000.0, 21000.0])
def test_a_near_rival_that_explains_a_little_more_completes_the_law(before: float) -> None:
    """It had explained more than half in its place; it is told by how much it does now."""
    selection = [NAMED[0], trial("hysteresis", before)]
    found = completions([selection], [trial("hysteresis", 2000.0)])
    assert list(found) == ["hysteresis"]
    assert found["hysteresis"].named == "threshold"
    assert found["hysteresis"].part == pytest.approx(0.05)


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(trial("hysteresis", 5000.0), id="explains much beside it"),
        pytest.param(trial("null_bias", 800.0), id="explained less than half in its place"),
        pytest.param(trial("hysteresis", 19.0), id="explains nothing"),
    ],
)
def test_what_is_no_near_rival_or_more_than_a_little_is_an_effect_of_its_own(other: Trial) -> None:
    """Two effects that act at once are not taken for one."""
    assert not completions([NAMED], [other])


def test_what_acts_elsewhere_does_not_complete_a_law() -> None:
    """A sensor that is off is no law of the valve, however alike both look."""
    before = [trial("threshold", 40000.0), trial("position.offset", 39000.0)]
    assert not completions([before], [trial("position.offset", 2000.0)])


def test_a_rival_that_completes_a_law_is_not_named_beside_it() -> None:
    """The next best candidate is, where there is one."""

    def judged(*trials: Trial) -> Round:
        fit = NAMED[0].fit
        first = Round(fit, [], NAMED, [], accepted=True)
        search = Search([], effects=[COORDINATES["threshold"]], rounds=[first])
        found = Round(fit, [], list(trials), [])
        judge(search, found)
        assert search.between["threshold"].rival == "hysteresis"
        return found

    assert not judged(trial("hysteresis", 2000.0)).accepted
    both = judged(trial("hysteresis", 2000.0), trial("null_bias", 800.0))
    assert both.accepted
    assert both.trials[0].score.coordinate.name == "null_bias"
