"""The predictor: a Kalman filter through the compiled model, and its frozen repetition.

Innovations of a predictor with process noise are immune to slow drift, which free-running
simulation adds up to many times the sensors' noise. The gains are computed once per fit and then
frozen, so that the innovations are an ordinary function of the parameters.
"""

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Gains,
    ParametrisedModel,
    Seen,
    Start,
)
from hil_emulator.identify.prediction.model_run.run import (
    Passage,
    Run,
    advance,
    compare,
    correct,
    elapse,
    enter,
    refine,
)
from hil_emulator.identify.prediction.model_run.small_matrices import duplicate

DISTURBANCES = 2
"""Null drift and supply deviation."""


def predict(
    model: ParametrisedModel, data: Data, start: Start, gains: Gains, residual: Array,
    track: Array, seen: Seen,
) -> None:  # fmt: skip
    """Run the frozen predictor.

    Args:
        model: at the parameters in question.
        data: the experiment.
        start: where it begins.
        gains: the frozen gains.
        residual: whitened innovations, shape (samples, chosen); overwritten.
        track: predicted signals, shape (samples, signals); overwritten, unless it is one row.
        seen: what sensors met; overwritten, unless it has no samples.

    """
    predict_samples(enter(model, data, start), gains, residual, track, seen)


def predict_samples(
    passage: Passage, gains: Gains, residual: Array, track: Array, seen: Seen
) -> None:
    """Predict all samples; arguments and results as of `predict`."""
    run, instruments, current = passage.run, passage.instruments, passage.data.current
    error, whitening, watches = passage.error, gains.whitening, len(seen.reading) > 0
    for k in range(len(current)):
        if watches:
            pick(run, seen.watched, seen.signals[k])
            duplicate(run.path, seen.path[k])
        passage.sense(*instruments)
        if watches:
            for i in range(len(error)):
                seen.reading[k, i] = instruments.reading[passage.data.chosen[i]]
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
        if watches:
            advance(run, run.steps, run.inputs[0], 0)
            pick(run, seen.watched, seen.corrected[k])
        elapse(run, current[k], passage.steps)
        if watches:
            refine(run)


def pick(run: Run, watched: Index, signals: Array) -> None:
    """Fill in some of a run's signals."""
    for i in range(len(watched)):
        signals[i] = run.signals[watched[i]]
