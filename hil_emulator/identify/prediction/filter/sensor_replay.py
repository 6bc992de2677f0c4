"""What other sensors would have shown along one and the same run of the model.

A transducer's parameter leaves the plant as it is: only through the corrections of the filter does
another reading move the states. So a run is recorded once; each set of sensors reads it again, and
the maps of the filter's linearisation carry what their readings change.
"""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import Data, ParametrisedModel, Seen
from hil_emulator.identify.prediction.model_run.run import install, move
from hil_emulator.identify.prediction.model_run.small_matrices import copy

HIDDEN = Seen(
    np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0, 0)), np.zeros((0, 0))
)
"""What a run leaves that nobody watches."""


def to_be_seen(model: ParametrisedModel, data: Data, watched: Index) -> Seen:
    """Return memory for what sensors meet.

    Args:
        model: whose sensors they are.
        data: along which it runs.
        watched: indices of the signals that any of them looks at.

    """
    each, (count, parts) = np.unique(watched).astype(np.int64), data.current.shape
    shape = count, len(each)
    path = np.empty((count, 2 * parts * model.steps, len(model.sources)))
    return Seen(each, np.empty(shape), np.empty(shape), path, np.empty((count, len(data.chosen))))


def reread(model: ParametrisedModel, data: Data, seen: Seen, change: Array) -> None:
    """Fill in how far the readings of a recorded run change with the sensors of a model.

    Args:
        model: whose sensors read it.
        data: the experiment.
        seen: the recorded run.
        change: of the readings, shape (samples, chosen); overwritten.

    """
    signals, path = np.zeros(model.signals), seen.path[0].copy()
    before = signals.copy()
    instruments = install(model, signals, path, data.period)
    for k in range(len(change)):
        for i in range(len(seen.watched)):
            signals[seen.watched[i]] = seen.signals[k, i]
        copy(seen.path[k].ravel(), path.ravel())
        model.sense(*instruments)
        for i in range(change.shape[1]):
            change[k, i] = instruments.reading[data.chosen[i]] - seen.reading[k, i]
        copy(signals, before)
        for i in range(len(seen.watched)):
            signals[seen.watched[i]] = seen.corrected[k, i]
        move(instruments.trace, model.traced, signals, before)
        move(instruments.history, model.recorded, signals, before)
