"""Floor: the error of a perfect model, from sensor noise and disturbances.

Null drift, supply ripple and unmodelled forces and flows move the machine away from any model. The
predictor's linearisation gives the covariance of the error from each source, one step ahead and
along the free run. The strength of a source is estimated from the growth of the errors with the
time since a restart. The null may drift faster than the predictor assumes. The strengths of all
other sources are limited to the assumed ones, so that the floor cannot hide larger missing physics.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from hil_emulator.identify.disagreement.freerun import RESTART_INTERVAL, Replay
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.filter.innovations import DISTURBANCES
from hil_emulator.identify.prediction.model_run.records import Restarts
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import Observer

AGES = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, RESTART_INTERVAL)
"""Ends of the classes of time since a restart, by which strengths are estimated [s] (assumed)."""

HOLD = 0.1
"""Weight of the assumed strength in the estimate of a strength (assumed)."""


FASTER = 25.0
"""Largest ratio of estimated and assumed variance of the null's drift (assumed: 5 squared)."""


@dataclass(frozen=True)
class Floor:
    """Variance of the error from each source, SI, shape (sources, samples, channels).

    The first source is the sensors' noise, with the uncertainty of the current between rows. The
    last two are the drifts of null and supply.
    """

    one_step: Array
    free: Array


def spread(observer: Observer, frozen: Frozen, replay: Replay) -> Floor:
    """Return the variance from each source in one experiment, at its assumed strength."""
    moving = np.flatnonzero(frozen.tuning.diffusion > 0.0)
    diffusion = np.zeros((len(moving), len(frozen.tuning.diffusion)))
    diffusion[np.arange(len(moving)), moving] = frozen.tuning.diffusion[moving]
    shape = (len(moving) + 1, *frozen.data.measured.shape)
    one, free = np.zeros(shape), np.zeros(shape)
    restarts = np.flatnonzero(replay.age == 1)
    first = int(restarts[0]) - 1 if len(restarts) else len(replay.age)
    window = max(int(replay.age.max(initial=0)), 1)
    observer.model.loops.carry(
        frozen.gains, frozen.jacobians, frozen.noise**2, frozen.data.unknown, diffusion,
        Restarts(first, window), one, free,
    )  # fmt: skip
    # single precision: a long recording needs much memory
    return Floor(one.astype(np.float32), free.astype(np.float32))


def strengths(floors: Sequence[Floor], replays: Sequence[Replay], period: float) -> Array:
    """Return the ratio of the estimated and the assumed strength of each source.

    Args:
        floors: of the experiments of one machine.
        replays: errors of the fitted model in these experiments.
        period: sample period [s].

    Returns:
        One number per source, the sensors' noise first; 1 if all free runs are too short.

    """
    ages = np.concatenate([r.age for r in replays])
    errors = np.concatenate([r.free for r in replays])
    parts = np.concatenate([f.free for f in floors], axis=1)
    ends = sorted({max(1, round(t / period)) for t in AGES})
    rows = []
    for begin, end in zip([0, *ends[:-1]], ends, strict=True):
        young = (ages > begin) & (ages <= end)
        for c in range(errors.shape[1]):
            good = young & np.isfinite(errors[:, c])
            size = float(np.sum(errors[good, c] ** 2))
            reached = np.sum(parts[:, good, c], axis=1)
            if size > 0.0:
                rows.append(np.append(reached, size) / max(size, float(reached[0])))
    if not rows:
        return np.ones(len(parts))
    table = np.array(rows)
    others = table.shape[1] - 2
    highest = np.ones(others)
    highest[-DISTURBANCES] = FASTER
    estimate = lsq_linear(
        np.vstack([table[:, 1:-1], HOLD * np.eye(others)]),
        np.concatenate([table[:, -1] - table[:, 0], np.full(others, HOLD)]), bounds=(0.0, highest),
    )  # fmt: skip
    return np.concatenate([[1.0], estimate.x])
