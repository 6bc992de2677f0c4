"""What other sensors would have shown along one and the same run of the model.

A transducer's parameter leaves the plant as it is: only through the corrections of the filter does
another reading move the states. So a run is recorded once; each set of sensors reads it again, and
the maps of the filter's linearisation carry what their readings change.
"""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.records import (
    Data,
    Gains,
    ParametrisedModel,
    Seen,
    Start,
)
from hil_emulator.identify.prediction.run import (
    advance,
    compare,
    correct,
    elapse,
    enter,
    install,
    move,
    refine,
)
from hil_emulator.identify.prediction.small_matrices import copy


def watch(model: ParametrisedModel, data: Data, start: Start, gains: Gains, watched: Index) -> Seen:
    """Run the frozen predictor, and keep what its sensors look at.

    Arguments as in `filter.predict`, and:
        watched: indices of the signals that any sensor looks at.

    """
    passage = enter(model, data, start)
    run, instruments = passage.run, passage.instruments
    signals, path, count = run.signals, run.path, len(data.current)
    seen = Seen(
        watched, np.empty((count, len(watched))), np.empty((count, len(watched))),
        np.empty((count, path.shape[0], path.shape[1])), np.empty((count, len(data.chosen))),
    )  # fmt: skip
    for k in range(count):
        for i in range(len(watched)):
            seen.signals[k, i] = signals[watched[i]]
        copy(path.ravel(), seen.path[k].ravel())
        model.sense(*instruments)
        for i in range(len(data.chosen)):
            seen.reading[k, i] = instruments.reading[data.chosen[i]]
        compare(passage, k)
        correct(run, instruments, gains.kalman[k], passage.error)
        advance(run, run.steps, run.inputs[0], 0)
        for i in range(len(watched)):
            seen.corrected[k, i] = signals[watched[i]]
        elapse(run, data.current[k], model.steps)
        refine(run)
    return seen


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
