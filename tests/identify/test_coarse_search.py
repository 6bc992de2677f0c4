"""Coarse search for the start of the first fit."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation import coarse_search
from hil_emulator.identify.estimation.coarse_search import coarse_start
from hil_emulator.identify.estimation.identifiability import identifiable
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

SLOW = pytest.mark.slow
REYNOLDS, VISCOSITY = "valve_critical_reynolds_number", "oil_kinematic_viscosity"


def fitter(**changes: float) -> Fitter:
    """Return a fitter of two short recordings of a machine."""
    data = [recorded(changes, kind, 3, 1.0) for kind in ("multisine", "steps")]
    return Fitter(Observer(knee_model(), INSTRUMENTS), data)


def fitted(**changes: float) -> dict[str, float]:
    """Return the parameters of a fit from the coarse start, by name, in their units."""
    machine = fitter(**changes)
    free = identifiable(machine.predictor, machine.experiments, parameters.ordinary(knee_model()))
    fit = converge(machine, free, coarse_start(machine, free))
    return {c.name: c.value(at) for c, at in zip(free, fit.at, strict=True)}


@pytest.mark.parametrize(
    "factor", [pytest.param(8.0, marks=SLOW), 1.0, pytest.param(1 / 7, marks=SLOW)]
)
def test_an_unstated_number_that_is_far_off_is_found(factor: float) -> None:
    """Edges turn turbulent at a product of number and viscosity, which is all that data show."""
    usual = 14.7 * 46e-6
    machine = fitted(valve_critical_reynolds_number=14.7 * factor)
    product = machine[REYNOLDS] * machine.get(VISCOSITY, 46e-6)
    assert product == pytest.approx(usual * factor, rel=0.3)


def test_friction_by_velocity_alone_is_found() -> None:
    """A rod that creeps below breakaway: its seals have no bend, and their friction a wide step."""
    creeping = fitted(friction_presliding_distance=10.0, friction_transition_velocity=5e-3)
    assert creeping["friction_presliding_distance"] > 0.05  # longer than the rod moves
    assert creeping["friction_transition_velocity"] == pytest.approx(5e-3, rel=0.1)


@pytest.mark.parametrize("distance", [pytest.param(4e-6, marks=SLOW), 1.2e-4])
def test_seals_that_bend_far_more_or_less_than_usual_ones_are_found(distance: float) -> None:
    """Held by them, the rod resonates: the deviance has several valleys over the distance."""
    machine = fitted(friction_presliding_distance=distance)
    assert machine["friction_presliding_distance"] == pytest.approx(distance, rel=0.1)


def test_of_a_long_recording_the_stretch_with_the_strongest_motion_is_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A rod at rest for a second, before it moves for half a second."""
    monkeypatch.setattr(coarse_search, "ENOUGH", 500)
    moved = recorded({"friction_transition_velocity": 0.01}, "multisine", 3, 0.5)
    resting = {name: np.repeat(values[:1], 1000) for name, values in moved.readings.items()}
    readings = {name: np.append(resting[name], moved.readings[name]) for name in resting}
    current = np.append(np.zeros(1000), moved.current)
    rested = Fitter(Observer(knee_model(), INSTRUMENTS),
                    [replace(moved, current=current, readings=readings)])  # fmt: skip
    free = parameters.ordinary(knee_model())
    start = dict(zip([c.name for c in free], coarse_start(rested, free).tolist(), strict=True))
    assert start["friction_transition_velocity"] > 1.0


def test_a_fit_with_a_missing_effect_ends_no_worse_than_it_began() -> None:
    """With a large overlap missing, the parameters stay plausible."""
    free = parameters.ordinary(knee_model())
    with_overlap = fitter(overlap_lap=2e-4)
    with_overlap.freeze(free, np.zeros(len(free)))
    begun = with_overlap.deviance(free, np.zeros(len(free)))
    fit = converge(with_overlap, free, np.zeros(len(free)))
    assert fit.deviance <= begun
    assert fit.frozen is not None
    with_overlap.freeze(free, fit.frozen)
    assert with_overlap.deviance(free, fit.frozen) == pytest.approx(fit.deviance)
