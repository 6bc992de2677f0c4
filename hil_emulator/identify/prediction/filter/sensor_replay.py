"""Readings of different sensors along one run of the model.

Transducer parameters change the states only through the corrections of the filter. A run is
therefore recorded once, every set of sensors reads it again, and the linearised filter propagates
the differences of the readings.
"""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import Data, ParametrisedModel, SensorInputs
from hil_emulator.identify.prediction.model_run.run import install, move
from hil_emulator.identify.prediction.model_run.small_matrices import copy

NOT_RECORDED = SensorInputs(
    np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0, 0)), np.zeros((0, 0))
)
"""Placeholder for a run whose sensor inputs are not recorded."""


def sensor_inputs(model: ParametrisedModel, data: Data, watched: Index) -> SensorInputs:
    """Return memory for the inputs of the sensors along a run.

    Args:
        model: with the sensors.
        data: the experiment.
        watched: indices of the signals that the sensors use.

    """
    each, (count, parts) = np.unique(watched).astype(np.int64), data.current.shape
    shape = count, len(each)
    path = np.empty((count, 2 * parts * model.steps, len(model.sources)))
    return SensorInputs(
        each, np.empty(shape), np.empty(shape), path, np.empty((count, len(data.chosen)))
    )


def reread(
    model: ParametrisedModel, data: Data, recorded_inputs: SensorInputs, change: Array
) -> None:
    """Compute the change of the readings of a recorded run with the sensors of a model.

    Args:
        model: with the sensors.
        data: the experiment.
        recorded_inputs: of the recorded run.
        change: receives the change of the readings, shape (samples, chosen).

    """
    signals, path = np.zeros(model.signals), recorded_inputs.path[0].copy()
    before = signals.copy()
    instruments = install(model, signals, path, data.period)
    for k in range(len(change)):
        for i in range(len(recorded_inputs.watched)):
            signals[recorded_inputs.watched[i]] = recorded_inputs.signals[k, i]
        copy(recorded_inputs.path[k].ravel(), path.ravel())
        model.sense(*instruments)
        for i in range(change.shape[1]):
            change[k, i] = instruments.reading[data.chosen[i]] - recorded_inputs.reading[k, i]
        copy(signals, before)
        for i in range(len(recorded_inputs.watched)):
            signals[recorded_inputs.watched[i]] = recorded_inputs.corrected[k, i]
        move(instruments.trace, model.traced, signals, before)
        move(instruments.history, model.recorded, signals, before)
