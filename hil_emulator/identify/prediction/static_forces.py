"""The model's force on the load for measured states, compiled."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.records import ParametrisedModel, Places
from hil_emulator.identify.prediction.run import INPUT_COUNT, Rate, Sense, install


def forces(
    rate: Rate, sense: Sense, model: ParametrisedModel, states: Array, acceleration: Array,
    at: Places, period: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the reading of the load cell and the signals for each measured state."""
    force, track = np.zeros(len(states)), np.zeros((len(states), model.signals))
    rates = np.zeros(states.shape[1])
    inputs = np.zeros(INPUT_COUNT)
    signals = np.zeros(model.signals)
    instruments = install(model, signals, period)
    for k in range(len(states)):
        rate(states[k], rates, model.par, inputs, signals)
        net = signals[at.hydraulic] - signals[at.friction] + signals[at.stop]
        predicted = signals[at.acceleration]
        rod = (net - signals[at.load]) / predicted if predicted != 0.0 else 0.0
        signals[at.load] = net - rod * acceleration[k]
        sense(*instruments)
        force[k] = instruments.reading[at.cell]
        track[k] = signals
    return force, track
