"""Whether the value of each effect comes out where it is, fitted with its own law."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

DEVIATIONS = 5.0
"""Standard deviations of white noise by which a value may be off: errors that last are more."""

NEAR = 0.005
"""Part of itself by which a value may be off whatever its deviation is."""

NEARLY = {"hysteresis": 0.015, "harmonic_force": 0.01}
"""The same where corrections by readings take over some of what the effect remembers."""

ALWAYS = ("internal_leakage", "stribeck_friction", "pressure_a.offset")
"""Candidates that every run asks of: a flow, a force, a sensor."""

FULL = pytest.mark.full(sibling="test_a_value_comes_out_where_it_is")

CANDIDATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [n if n in ALWAYS else pytest.param(n, marks=FULL) for n in CANDIDATES]
)
def test_a_value_comes_out_where_it_is(name: str) -> None:
    """From two recordings of a machine with the effect in its typical size, unless it is invisible.

    Ordinary parameters are off as well. Nothing of the predictor is in the data: they come from the
    emulator, with its step of 20 us.
    """
    effect = CANDIDATES[name]
    size = float(np.clip(1.0, *effect.bounds))
    changed = {effect.field: effect.value(size)}
    changes, sensors = ({}, {effect.channel: changed}) if effect.channel else (changed, None)
    data = [recorded(changes, kind, 3, sensors=sensors) for kind in ("multisine", "steps")]
    free = [*parameters.ordinary(knee_model()), effect]
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), data)
    fit = converge(fitter, free, np.append(np.zeros(len(free) - 1), size), [effect])
    at = fit.at
    if np.linalg.norm(fit.jacobian[:, -1]) * size < 1.0:
        pytest.skip("nothing in these recordings shows it")
    deviation = np.sqrt(fit.covariance()[-1, -1])
    print(f"off by {at[-1] / size - 1.0:.2%}, {(at[-1] - size) / deviation:.1f} deviations")
    assert abs(at[-1] - size) < max(DEVIATIONS * deviation, NEARLY.get(name, NEAR) * size)
