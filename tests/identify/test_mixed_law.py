"""Laws between two of the catalogue: a valve with dry friction and magnetic hysteresis."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import Evidence, Trial
from hil_emulator.identify.selection.mixed_law import mixed_laws
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Score
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

COORDINATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}
THRESHOLD, HYSTERESIS = COORDINATES["threshold"], COORDINATES["hysteresis"]
BOTH = {"threshold_current": 4e-5, "hysteresis_width": 2e-5}
ONE = {"threshold_current": 4e-5}


def measured(changes: dict[str, float]) -> list[Experiment]:
    """Return data of a machine with such a valve."""
    return [recorded(changes, kind, 5 + i) for i, kind in enumerate(("multisine", "triangles"))]


def fitted(fitter: Fitter, effects: list[Coordinate], sizes: list[float]) -> Fit:
    """Return a fit of the model with these effects, frozen there."""
    free = [c for c in parameters.ordinary(knee_model())
            if c.name in ("valve_gain", "oil_bulk_modulus", "coulomb_friction")]  # fmt: skip
    whole, at = [*free, *effects], np.append(np.zeros(len(free)), sizes)
    for _ in range(2):
        fitter.freeze(whole, at)
        fit = fitter.fit(whole, at, 6)
        at = fit.at
    return fit


def trial(knob: Coordinate, delta_chi2: float, size: float) -> Trial:
    """Return a candidate with a final size and a gain."""
    empty = np.zeros(0)
    fit = Fit([knob], np.array([size]), empty, np.zeros((0, 1)), 0.0)
    score = Score(knob, delta_chi2, size, delta_chi2, empty, empty, empty)
    return Trial(score, fit, Evidence(delta_chi2, delta_chi2, delta_chi2, 20.0), 1.0)


def named(*trials: Trial) -> Round:
    """Return a round in which the first of some candidates was named."""
    return Round(trials[0].fit, [t.score for t in trials], list(trials), [], accepted=True)


@pytest.fixture(scope="module")
def twofold() -> Fitter:
    """Return the fit of a machine with both."""
    return Fitter(Observer(knee_model(), INSTRUMENTS), measured(BOTH))


@pytest.fixture(scope="module")
def single() -> Fitter:
    """Return the fit of a machine whose spool only sticks."""
    return Fitter(Observer(knee_model(), INSTRUMENTS), measured(ONE))


def searched(base: Fit, *rounds: Round) -> Search:
    """Return a search that ended with such a model."""
    effects = [r.trials[0].score.coordinate for r in rounds]
    ordinary = [c for c in base.coordinates if c not in effects]
    search = Search(ordinary, effects=effects, rounds=list(rounds), final=base)
    search.rounds.append(replace(rounds[0], base=base, trials=[], accepted=False))
    return search


WON = trial(THRESHOLD, 40000.0, 1.6), trial(HYSTERESIS, 32000.0, 0.5)
"""Of the round in which the threshold was named."""


def test_a_rival_that_shares_the_action_completes_the_law(twofold: Fitter) -> None:
    """A refit that starts between both shows the loop in addition to the fitted threshold."""
    base = fitted(twofold, [THRESHOLD], [1.6])
    completions = mixed_laws(twofold, searched(base, named(*WON)), lambda: None)
    assert list(completions) == ["threshold"]
    assert completions["threshold"].rival == "hysteresis"
    assert 0.0 < completions["threshold"].part < 0.1


def test_a_correct_law_is_not_completed(single: Fitter) -> None:
    """A rival that explained much in its place, but adds nothing, remains a rival."""
    base = fitted(single, [THRESHOLD], [1.6])
    assert mixed_laws(single, searched(base, named(*WON)), lambda: None) == {}


def test_a_rival_that_fails_on_held_out_data_completes_nothing(
    twofold: Fitter, single: Fitter
) -> None:
    """The loop of the training data is not in the valve of the held-out ones."""
    base = fitted(twofold, [THRESHOLD], [1.6])
    held = twofold.frozen_at(single.experiments, base.coordinates, base.at)
    assert mixed_laws(twofold, searched(base, named(*WON)), lambda: held) == {}
