"""What a model does when it is left alone: free runs that restart from filtered states.

Half a second of simulation shows what a controller in the loop would meet, and is short enough
that drift does not swamp everything. The model is driven by the recorded current; nothing corrects
it between two restarts. One pass also yields the error one step ahead.
"""

from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index, Single
from hil_emulator.identify.prediction.model_run.records import Restarts
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer

RESTART_INTERVAL = 0.5
"""Time between two restarts [s]."""

FILTER_SETTLING = 0.25
"""Time at the start of an experiment before which no free run begins: the filter still learns the
null, and a wrong one carries the rod away (assumed)."""


@dataclass(frozen=True)
class Replay:
    """How far one model is from one experiment.

    Attributes:
        one_step: measured less predicted one sample ahead, SI, shape (samples, channels).
        free: the same in the free run.
        age: samples since the restart from which the free run comes, shape (samples,); 0 before
            the first.
        track: the model's signals one sample ahead, shape (samples, signals).

    """

    one_step: Array
    free: Array
    age: Index
    track: Array | Single


def replay(observer: Observer, frozen: Frozen, par: Array, chan: Array) -> Replay:
    """Return the errors of a model along one experiment, NaN while its filter settles.

    Args:
        observer: sees the experiment.
        frozen: the experiment with the gains of this model.
        par: the plant's parameters.
        chan: the transducers' parameters.

    """
    data, period = frozen.data, frozen.data.period
    restarts = Restarts(round(FILTER_SETTLING / period), max(2, round(RESTART_INTERVAL / period)))
    errors = observer.model.loops.run_freely(
        observer.at(par, chan, data, every_signal=True), data, frozen.start, frozen.gains, restarts
    )
    errors.one[data.settling] = np.nan
    first, window = restarts
    age = np.maximum((np.arange(len(data.measured)) - first - 1) % window + 1, 0)
    age[: first + 1] = 0
    # of a long recording it is large
    return Replay(errors.one, errors.free, age, errors.track.astype(np.float32))
