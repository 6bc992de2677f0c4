"""The model's force on the load for measured states, compiled."""

from typing import Any

import numpy as np

from hil_emulator.identify.prediction.filter import INPUT_COUNT


def forces(
    rate: Any, sense: Any, states: Any, acceleration: Any, par: Any, chan: Any, remembered: Any,
    sources: Any, places: Any, period: float, force: Any, track: Any,
) -> None:  # fmt: skip
    """Fill the reading of the load cell and the signals for each measured state.

    `places` are the indices of hydraulic, friction, stop and load force and of acceleration among
    the signals, then of the load cell among the channels.
    """
    rates = np.zeros(states.shape[1])
    inputs = np.zeros(INPUT_COUNT)
    signals = np.zeros(track.shape[1])
    normal, reading = np.zeros(len(sources)), np.zeros(len(sources))
    overrange = np.zeros(len(sources), np.int64)
    trace = np.full(remembered[1], np.nan)
    history = np.full(remembered[2], np.nan)
    for k in range(len(states)):
        rate(states[k], rates, par, inputs, signals)
        net = signals[places[0]] - signals[places[1]] + signals[places[2]]
        predicted = signals[places[4]]
        rod = (net - signals[places[3]]) / predicted if predicted != 0.0 else 0.0
        signals[places[3]] = net - rod * acceleration[k]
        sense(signals, sources, chan, trace, history, normal, period, reading, overrange)
        force[k] = reading[places[5]]
        track[k] = signals
