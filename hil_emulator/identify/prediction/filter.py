"""The predictor: a Kalman filter through the compiled model, and its frozen repetition.

Innovations of a predictor with process noise are immune to slow drift, which free-running
simulation adds up to many times the sensors' noise. The gains are computed once per fit and then
frozen, so that the innovations are an ordinary function of the parameters.

Every function takes the kernel's `sense` as its first argument.
"""

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.records import Data, Gains, ParametrisedModel, Start
from hil_emulator.identify.prediction.run import (
    Instruments,
    Run,
    Sense,
    begin,
    correct,
    elapse,
    install,
)

DISTURBANCES = 2
"""Null drift and supply deviation."""


def predict(
    sense: Sense, model: ParametrisedModel, data: Data, start: Start, gains: Gains,
    residual: Array, track: Array,
) -> None:  # fmt: skip
    """Run the frozen predictor.

    Args:
        sense: the kernel's sensor chain.
        model: at the parameters in question.
        data: the experiment.
        start: where it begins.
        gains: the frozen gains.
        residual: whitened innovations, shape (samples, chosen); overwritten.
        track: predicted signals, shape (samples, signals); overwritten, unless it is one row.

    """
    run = begin(model, start, data.current[0])
    instruments = install(model, run.signals, run.path, data.period)
    predict_samples(
        sense, run, instruments, data, gains, model.steps, np.zeros(len(data.chosen)), residual,
        track,
    )  # fmt: skip


def predict_samples(
    sense: Sense, run: Run, instruments: Instruments, data: Data, gains: Gains, steps: int,
    error: Array, residual: Array, track: Array,
) -> None:  # fmt: skip
    """Predict all samples; arguments and results as of `predict`, with its run."""
    reading = instruments.reading
    current, measured, chosen = data.current, data.measured, data.chosen
    kalman, whitening = gains.kalman, gains.whitening
    m = len(chosen)
    for k in range(len(current)):
        sense(*instruments)
        for i in range(m):
            error[i] = measured[k, i] - reading[chosen[i]]
            if not np.isfinite(measured[k, i]):
                error[i] = 0.0
        for i in range(m):
            whitened = 0.0
            for j in range(m):
                whitened += whitening[k, j, i] * error[j]
            residual[k, i] = whitened
        if len(track) > 1:
            for i in range(len(run.signals)):
                track[k, i] = run.signals[i]
        correct(run, instruments, kalman[k], error)
        elapse(run, current[k], steps)
