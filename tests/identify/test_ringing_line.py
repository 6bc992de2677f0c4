"""A pressure sensor at the end of a line that rings, which is no effect of the catalogue."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter, lfilter_zi

from hil_emulator.identify.estimation.free_terms import score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.free_terms.balances import TAP_A, TAP_B
from hil_emulator.identify.prediction.free_terms.term_matching import is_curve
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

FREQUENCY, DAMPING = 2.0 * np.pi * 120.0, 0.1
"""Of the line [rad/s], and over the critical one: half a metre of hose (assumed)."""


def ringing(values: Array, period: float) -> Array:
    """Return a pressure at the end of the line, at rest before the first sample."""
    line = ([FREQUENCY**2], [1.0, 2.0 * DAMPING * FREQUENCY, FREQUENCY**2])
    b, a, _ = cont2discrete(line, period)
    out, _ = lfilter(b.ravel(), a, values, zi=lfilter_zi(b.ravel(), a) * values[0])
    return np.asarray(out)


def at_a_line(experiment: Experiment, channel: str) -> Experiment:
    """Return an experiment in which a pressure is read at the end of such a line."""
    read = ringing(experiment.readings[channel], experiment.period)
    return replace(experiment, readings={**experiment.readings, channel: read})


@pytest.mark.slow
@pytest.mark.parametrize(("channel", "balance"), [("pressure_a", TAP_A), ("pressure_b", TAP_B)])
def test_a_line_that_rings_shows_at_its_sensor(channel: str, balance: object) -> None:
    """Of all free terms that of its curvature explains the most, but for its own calibration."""
    fitter = Fitter(
        Observer(knee_model(), INSTRUMENTS), [at_a_line(recorded({}, "multisine", 3), channel)]
    )
    free = parameters.ordinary(knee_model())
    fitter.freeze(free, np.zeros(len(free)))
    fit = fitter.fit(free, np.zeros(len(free)), 3)
    terms = score_terms(fitter, free, fit.at, Projection(fit))
    best, *rest = [t for t in terms if not is_curve(t)]
    assert terms[0].balance is best.balance is balance
    assert best.regressor == f"second derivative of {channel.replace('_', ' ')}"
    assert best.statistic > 1.2 * rest[0].statistic
