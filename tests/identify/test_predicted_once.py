"""Computations that are not repeated, and those that are: fits begin where others have ended."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation import outer_iteration
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded


@pytest.fixture(scope="module")
def fitter() -> Fitter:
    """Return a fitter of one short experiment."""
    return Fitter(Observer(knee_model(), INSTRUMENTS), [recorded({}, "multisine", 5, 0.5)])


@pytest.fixture(scope="module")
def free() -> list[Coordinate]:
    """Return what is fitted."""
    return parameters.ordinary(knee_model())[:2]


def test_gains_are_computed_anew_only_where_something_moved(
    fitter: Fitter, free: list[Coordinate]
) -> None:
    """The same point gives the same gains, also after other weights; another point its own."""
    fitter.freeze(free, np.zeros(2))
    first = fitter.batch
    fitter.batch = replace(first, frozen=[])
    fitter.freeze(free, np.zeros(2))
    assert fitter.batch is first
    fitter.freeze(free, np.array([0.5, 0.0]))
    before, after = first.frozen[0], fitter.frozen[0]
    assert isinstance(before, Frozen)
    assert isinstance(after, Frozen)
    assert not np.array_equal(before.gains.kalman, after.gains.kalman)


def test_gains_that_somebody_still_has_are_not_computed_again(free: list[Coordinate]) -> None:
    """They serve with weights of their own; of another recording, or when gone, they are new."""
    observer, point = Observer(knee_model(), INSTRUMENTS), knee_model().memory(free, np.zeros(2))
    one, other = (recorded({}, "multisine", seed, 0.5) for seed in (5, 6))
    first = observer.freeze(one, *point)
    first.weights = np.full(len(INSTRUMENTS), 3.0)
    again = observer.freeze(one, *point)
    assert again.gains is first.gains
    assert again.weights.tolist() == [1.0] * len(INSTRUMENTS)
    assert observer.freeze(other, *point).gains is not first.gains
    kept = first.gains
    del first, again
    assert observer.freeze(one, *point).gains is not kept


def test_a_prediction_that_is_remembered_is_that_of_its_point_and_data(
    fitter: Fitter, free: list[Coordinate]
) -> None:
    """Asked twice at a point, between others and with other data, each answer is its own."""
    fitter.freeze(free, np.zeros(2))
    points = [np.zeros(2), np.array([0.5, 0.0]), np.array([0.5, 0.0]), np.zeros(2)]
    here, there, again, back = (fitter.residual(free, at) for at in points)
    np.testing.assert_array_equal(here, back)
    np.testing.assert_array_equal(there, again)
    assert not np.array_equal(here, there)
    frozen = fitter.frozen[0]
    assert isinstance(frozen, Frozen)
    halved = replace(frozen, data=frozen.data._replace(current=0.5 * frozen.data.current))
    memory = knee_model().memory(free, np.zeros(2))
    other = fitter.predictor.innovations(halved, *memory)[0]
    assert not np.array_equal(here, other.ravel())


def converged(free: list[Coordinate], monkeypatch: pytest.MonkeyPatch) -> tuple[Fit, int]:
    """Return an estimate from some way off, and how many times it has asked for gains."""
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), [recorded({}, "multisine", 5, 0.5)])
    asked, freeze = [0], fitter.freeze

    def counted(coordinates: list[Coordinate], at: np.ndarray) -> None:
        asked[0] += 1
        freeze(coordinates, at)

    monkeypatch.setattr(fitter, "freeze", counted)
    return outer_iteration.converge(fitter, free, np.full(2, 0.8)), asked[0]


def test_gains_stay_where_the_estimate_hardly_moves(
    free: list[Coordinate], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Computed anew in every pass, they lead to the same estimate."""
    fit, few = converged(free, monkeypatch)
    monkeypatch.setattr(outer_iteration, "UNNOTICED", -1.0)
    exact, many = converged(free, monkeypatch)
    assert few < many
    apart = np.abs(fit.at - exact.at) / np.sqrt(np.diag(exact.covariance()))
    assert np.max(apart) < 0.02
