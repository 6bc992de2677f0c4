"""Free runs: simulation with the recorded current, restarted from filtered states.

The readings do not correct the model between two restarts. A run of 0.5 s covers the time scale of
a controller in the loop, and drift does not yet dominate its error. The same pass gives the error
one step ahead.
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
"""Time at the start of an experiment without free runs [s]: a null bias that the filter has not yet
estimated would make the rod drift (assumed)."""


@dataclass(frozen=True)
class Replay:
    """Errors of one model in one experiment.

    Attributes:
        one_step: measured less predicted one sample ahead, SI, shape (samples, channels).
        free: measured less simulated in the free run, SI, the same shape.
        age: samples since the last restart, shape (samples,); 0 before the first restart.
        track: the model's signals one sample ahead, shape (samples, signals).

    """

    one_step: Array
    free: Array
    age: Index
    track: Array | Single


def replay(observer: Observer, frozen: Frozen, par: Array, chan: Array) -> Replay:
    """Return the errors of a model along one experiment, NaN while its filter settles.

    Args:
        observer: the predictor.
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
    # single precision: a long recording needs much memory
    return Replay(errors.one, errors.free, age, errors.track.astype(np.float32))
