"""Starting points of refits for candidates whose linearisation fails."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import TOLERATED, Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.scan import scan
from hil_emulator.identify.selection.search import Searcher
from hil_emulator.identify.selection.starts import SLOW_FACTOR, NonlinearCheck, trial_points
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

DELAY = 7e-4
"""Of the set point that the machine has and the configuration lacks [s]."""


@pytest.fixture(scope="module")
def slow() -> tuple[Fitter, Fit]:
    """Return a fit in which a slow valve masks the delay."""
    kinds = ("multisine", "steps")
    data = [recorded({"transport_delay_time": DELAY}, kind, 7 + i) for i, kind in enumerate(kinds)]
    model = knee_model()
    free = [c for c in parameters.ordinary(model)
            if c.name in ("valve_gain", "valve_natural_frequency", "oil_bulk_modulus")]  # fmt: skip
    searcher = Searcher(Observer(model, INSTRUMENTS), data, [], [], free)
    return searcher.fitter, converge(searcher.fitter, free, np.zeros(len(free)))


def effect(name: str) -> Coordinate:
    """Return a candidate."""
    return next(c for c in parameters.candidates(knee_model(), INSTRUMENTS) if c.name == name)


def test_a_delay_is_found_behind_a_valve_that_was_fitted_slow(
    slow: tuple[Fitter, Fit],
) -> None:
    """The delay is tried with the valve's bandwidth reset to its data sheet."""
    fitter, fit = slow
    valve = [c.name for c in fit.coordinates].index("valve_natural_frequency")
    assert fit.at[valve] < -TOLERATED
    delay = effect("transport_delay")
    best = NonlinearCheck(fitter, fit).best(scan(fitter, fit, [delay]), 1)[0]
    assert best.start is not None
    assert best.estimate * delay.scale == pytest.approx(DELAY, rel=0.05)
    assert abs(best.start[valve]) < 1.0


def test_an_effect_masked_by_a_parameter_is_proposed(
    slow: tuple[Fitter, Fit],
) -> None:
    """A delay masked by the slow valve is proposed, a bias without any gain is not.

    The other likely candidates stay and come first.
    """
    fitter, fit = slow
    delay, bias, other = effect("transport_delay"), effect("null_bias"), effect("overlap")
    scores = scan(fitter, fit, [delay, bias, other])
    first = [next(s for s in scores if s.coordinate is other)]
    best = NonlinearCheck(fitter, fit).masked_by_nuisance(scores, first, 1)
    assert [s.coordinate.name for s in best] == ["overlap", "transport_delay"]
    assert best[1].estimate * delay.scale == pytest.approx(DELAY, rel=0.05)


def test_sizes_are_tried_next_to_steep_friction() -> None:
    """A size is skipped if it makes the model slow, not if friction makes it slow anyway."""
    model = knee_model()
    free = [c for c in parameters.ordinary(model) if c.name == "friction_transition_velocity"]
    spring = effect("load_spring")
    fitter = Fitter(Observer(model, INSTRUMENTS), [recorded({}, "steps", 3, 0.2)])
    steep = np.array([free[0].at(1e-5)])
    fitter.freeze(free, steep)
    fit = fitter.fit(free, steep, 0)
    assert fitter.cost(free, fit.at) > SLOW_FACTOR
    score = scan(fitter, fit, [spring])[0]
    points = trial_points(fitter, score, fit, (0.1, 0.3, 1.0))
    assert [point[-1] for point in points] == [0.1, 0.3, 1.0]
