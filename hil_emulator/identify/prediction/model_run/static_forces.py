"""Force on the load for measured states, compiled."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.model_run.records import Moments, ParametrisedModel, Places
from hil_emulator.identify.prediction.model_run.run import INPUT_COUNT, install


def forces(
    model: ParametrisedModel, moments: Moments, at: Places, period: float, track: Array
) -> Array:
    """Return the force reading for each measured state that is used, else 0.

    The signals are stored in `track`, shape (samples, signals), unless it has no rows.
    """
    states, acceleration = moments.states, moments.acceleration
    force = np.zeros(len(states))
    rates = np.zeros(states.shape[1])
    inputs = np.zeros(INPUT_COUNT)
    signals = np.zeros(model.signals)
    # sensor inputs are constant within a sample
    no_path = np.empty((0, len(model.sources)))
    instruments = install(model, signals, no_path, period)
    for k in range(len(states)):
        if not moments.present[k]:
            continue
        model.rate(states[k], rates, model.par, inputs, signals)
        net = signals[at.hydraulic] - signals[at.friction] + signals[at.stop]
        passed_on = net - signals[at.rod_mass] * acceleration[k]
        if at.driven:  # the drive's force moves the load, and the rod as well
            signals[at.load] = (
                signals[at.resisting] + model.par[at.mass] * acceleration[k] - passed_on
            )
        else:
            signals[at.load] = passed_on
        model.sense(*instruments)
        force[k] = instruments.reading[at.cell]
        if len(track):
            track[k] = signals
    return force
