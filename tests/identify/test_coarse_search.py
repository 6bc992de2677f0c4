"""Coarse search for the start of the first fit."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.coarse_search import coarse_start
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

REYNOLDS = "valve_critical_reynolds_number"


def fitter(**changes: float) -> Fitter:
    """Return a fitter of a short recording of a machine."""
    data = [recorded(changes, "multisine", 3, 0.5)]
    return Fitter(Observer(knee_model(), INSTRUMENTS), data)


@pytest.mark.parametrize(("number", "sense"), [(120.0, 1.0), (14.7, 0.0), (2.0, -1.0)])
def test_a_fit_begins_near_an_unstated_number_that_is_far_off(number: float, sense: float) -> None:
    """Wide parameters start near their true values, stated ones at their configured values."""
    free = parameters.ordinary(knee_model())
    names = [c.name for c in free]
    start = coarse_start(fitter(valve_critical_reynolds_number=number), free)
    assert np.sign(start[names.index(REYNOLDS)]) == sense
    assert not any(at for c, at in zip(free, start, strict=True) if c.stated)


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
