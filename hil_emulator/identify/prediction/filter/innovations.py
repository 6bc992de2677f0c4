"""Predictor with frozen Kalman gains, which computes the innovations.

A predictor with process noise corrects slow drift, whose effect in a simulation grows to many times
the sensor noise. The gains are computed once per fit and then frozen, so that the innovations are a
function of the parameters only.
"""

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Gains,
    ParametrisedModel,
    SensorInputs,
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
    track: Array, recorded_inputs: SensorInputs,
) -> None:  # fmt: skip
    """Run the frozen predictor.

    Args:
        model: with its parameters.
        data: the experiment.
        start: of the run.
        gains: frozen gains.
        residual: receives the whitened innovations, shape (samples, chosen).
        track: receives the predicted signals, shape (samples, signals), unless it has one row.
        recorded_inputs: receives the inputs of the sensors, unless it has no samples.

    """
    predict_samples(enter(model, data, start), gains, residual, track, recorded_inputs)


def predict_samples(
    passage: Passage, gains: Gains, residual: Array, track: Array, recorded_inputs: SensorInputs
) -> None:
    """Predict all samples; arguments and results as for `predict`."""
    run, instruments, current = passage.run, passage.instruments, passage.data.current
    error, whitening, watches = passage.error, gains.whitening, len(recorded_inputs.reading) > 0
    for k in range(len(current)):
        if watches:
            pick(run, recorded_inputs.watched, recorded_inputs.signals[k])
            duplicate(run.path, recorded_inputs.path[k])
        passage.sense(*instruments)
        if watches:
            for i in range(len(error)):
                recorded_inputs.reading[k, i] = instruments.reading[passage.data.chosen[i]]
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
            pick(run, recorded_inputs.watched, recorded_inputs.corrected[k])
        elapse(run, current[k], passage.steps)
        if watches:
            refine(run)


def pick(run: Run, watched: Index, signals: Array) -> None:
    """Copy the watched signals of a run."""
    for i in range(len(watched)):
        signals[i] = run.signals[watched[i]]
