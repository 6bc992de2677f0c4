"""The predictor: a Kalman filter through the compiled model, and its frozen repetition.

Innovations of a predictor with process noise are immune to slow drift, which free-running
simulation adds up to many times the sensors' noise. The gains are computed once per fit and then
frozen, so that the innovations are an ordinary function of the parameters.
"""

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.records import Data, Gains, ParametrisedModel, Start
from hil_emulator.identify.prediction.run import Passage, compare, correct, elapse, enter

DISTURBANCES = 2
"""Null drift and supply deviation."""


def predict(
    model: ParametrisedModel, data: Data, start: Start, gains: Gains, residual: Array, track: Array
) -> None:
    """Run the frozen predictor.

    Args:
        model: at the parameters in question.
        data: the experiment.
        start: where it begins.
        gains: the frozen gains.
        residual: whitened innovations, shape (samples, chosen); overwritten.
        track: predicted signals, shape (samples, signals); overwritten, unless it is one row.

    """
    predict_samples(enter(model, data, start), gains, residual, track)


def predict_samples(passage: Passage, gains: Gains, residual: Array, track: Array) -> None:
    """Predict all samples; arguments and results as of `predict`."""
    run, instruments, current = passage.run, passage.instruments, passage.data.current
    error, whitening = passage.error, gains.whitening
    for k in range(len(current)):
        passage.sense(*instruments)
        compare(passage, k)
        for i in range(len(error)):
            whitened = 0.0
            for j in range(len(error)):
                whitened += whitening[k, j, i] * error[j]
            residual[k, i] = whitened
        if len(track) > 1:
            for i in range(len(run.signals)):
                track[k, i] = run.signals[i]
        correct(run, instruments, gains.kalman[k], error)
        elapse(run, current[k], passage.steps)
