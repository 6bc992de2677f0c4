"""What a model that is right in everything would still leave: sensor noise and disturbances.

Null drift, supply ripple and unmodelled forces and flows push the machine away from any model. How
far follows from the predictor's own linearisation: the covariance of its error under each source,
carried one step ahead and through the free run. How strong each source is, the data say, by how
the errors grow with time since a restart. The null may drift faster than the predictor assumes, as
the data show; everything else counts for no more than it assumes of a usual machine, so that no
more missing physics than that can hide in the floor.
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
"""Ends of the ages of the free run by which the sources' strengths are read [s] (assumed)."""

HOLD = 0.1
"""Weight of the assumed strength of a source that the data do not show (assumed)."""


FASTER = 25.0
"""Largest variance of the null's drift over the assumed one (assumed: five times the deviation)."""


@dataclass(frozen=True)
class Floor:
    """Variance that each source leaves, SI, shape (sources, samples, channels).

    The first source is the sensors' noise, with what is not known of the current between rows; the
    last two are drift of null and supply.
    """

    one_step: Array
    free: Array


def spread(observer: Observer, frozen: Frozen, replay: Replay) -> Floor:
    """Return what each source leaves in one experiment, at the strength that is assumed."""
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
    # of a long recording these are large
    return Floor(one.astype(np.float32), free.astype(np.float32))


def strengths(floors: Sequence[Floor], replays: Sequence[Replay], period: float) -> Array:
    """Return how strong each source is over what is assumed, the sensors' noise first.

    Args:
        floors: of the experiments of one machine.
        replays: the errors of the fitted model in them.
        period: sample period [s].

    Returns:
        One number per source; ones where no free run is long enough to tell.

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
    found = lsq_linear(
        np.vstack([table[:, 1:-1], HOLD * np.eye(others)]),
        np.concatenate([table[:, -1] - table[:, 0], np.full(others, HOLD)]), bounds=(0.0, highest),
    )  # fmt: skip
    return np.concatenate([[1.0], found.x])
