"""Rivals refitted in place of a named effect of the final model."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.selection.rivals import confirmed_rivals
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

COORDINATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}


@pytest.fixture(scope="module")
def leaking() -> tuple[Fitter, Fit]:
    """Return a leak model fitted to a machine that also has a strong load spring."""
    changes = {"internal_leakage_conductance": 1e-14, "load_spring_stiffness": 4000.0}
    data = [recorded(changes, kind, 5 + i) for i, kind in enumerate(("multisine", "steps"))]
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), data)
    free = [c for c in parameters.ordinary(knee_model())
            if c.name in ("valve_gain", "oil_bulk_modulus", "coulomb_friction")]  # fmt: skip
    free.append(COORDINATES["internal_leakage"])
    at = np.zeros(len(free))
    for _ in range(2):
        fitter.freeze(free, at)
        final = fitter.fit(free, at, 6)
        at = final.at
    return fitter, final


def test_an_effect_that_gains_as_much_in_addition_is_not_a_rival(
    leaking: tuple[Fitter, Fit],
) -> None:
    """The spring explains more than the leak, but a different residual."""
    fitter, final = leaking
    spring = [COORDINATES["load_spring"]], np.array([1.0])
    named, at = final.coordinates[-1].name, final.at[:-1]
    instead = fitter.fit([*final.coordinates[:-1], *spring[0]], np.append(at, 1.0), 4)
    assert instead.chi2 < final.chi2
    assert confirmed_rivals(fitter, final, named, [spring]) == []


def test_a_copy_of_the_effect_is_a_rival(leaking: tuple[Fitter, Fit]) -> None:
    """An effect that explains all of the same residual is reported as a rival."""
    fitter, final = leaking
    leak = final.coordinates[-1]
    model = [leak], np.array([0.5 * final.at[-1]])
    assert confirmed_rivals(fitter, final, leak.name, [model]) == [leak.name]
