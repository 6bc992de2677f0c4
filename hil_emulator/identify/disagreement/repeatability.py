"""Repeatability of a residual: noise, or a part that recurs in the same state of the rod.

If a bench repeats its strokes, the scatter of the residual between visits of one state is the pure
error of a test for lack of fit (Fisher 1922; for near replicates Daniel and Wood 1980, section 7).
No model of the state can explain it. A larger residual shows that the model lacks a term.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hil_emulator.identify.disagreement.gap import View
from hil_emulator.identify.disagreement.residuals import shown_as
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.predictor import Predictor

STATES = ("position", "velocity", "pressure_a", "pressure_b")
"""Channels of the state."""

MOST = 20_000
"""Largest number of samples that are compared; longer recordings are decimated."""

NEIGHBOURS = 32
"""Number of nearest samples that may belong to another visit."""

AGAIN = 0.5
"""Shortest time between two visits of a state [s] (assumed)."""

REPEATING = 0.5
"""Recurring share of the residual's variance from which it is unexplained. Sensor noise and
disturbances that the bench does not repeat differ between visits."""


@dataclass(frozen=True)
class Repeatability:
    """Residual of a model, and its scatter between visits of one state.

    Attributes:
        channel: of the residual.
        rms: root mean square of the residual, in `unit`.
        scatter: standard deviation between visits of one state.
        spread: standard deviation of the readings.
        unit: of these numbers.

    """

    channel: str
    rms: float
    scatter: float
    spread: float
    unit: str

    @property
    def share(self) -> float:
        """Share of the residual's variance that recurs."""
        return max(0.0, 1.0 - (self.scatter / self.rms) ** 2) if self.rms > 0.0 else 0.0

    @property
    def unexplained(self) -> bool:
        """Whether most of the variance recurs."""
        return self.share > REPEATING

    def __str__(self) -> str:
        factor, unit = shown_as(self.unit)
        return (
            f"{self.rms * factor:.3g} {unit} rms of the {self.channel.replace('_', ' ')} are "
            f"unexplained ({self.rms / self.spread:.0%} of its standard deviation), and "
            f"{self.share:.0%} of this variance recurs in the same state of the rod, so it is not "
            "noise"
        )


def repeatability(predictor: Predictor, views: Sequence[View]) -> Repeatability:
    """Return the repeatability of the residual of a predictor's only channel."""
    channel, unit = predictor.channels[0], predictor.measure
    residuals = [v.replay.one_step[:, 0] for v in views]
    names = predictor.model.signal_names
    rows = [v.replay.track[:, [names.index(n) for n in STATES]] for v in views]
    times, begin = [], 0.0
    for view in views:
        times.append(begin + view.experiment.period * np.arange(view.experiment.samples))
        begin = times[-1][-1] + 2.0 * AGAIN
    residual, time = np.concatenate(residuals), np.concatenate(times)
    state = np.vstack(rows).astype(np.float64)
    chosen = np.flatnonzero(np.isfinite(residual))
    chosen = chosen[:: max(1, len(chosen) // MOST)]
    readings = [v.experiment.readings[channel] for v in views]
    return Repeatability(
        channel, float(np.sqrt(np.mean(residual[chosen] ** 2))),
        _scatter(residual[chosen], state[chosen], time[chosen]),
        float(np.nanstd(np.concatenate(readings))), unit,
    )  # fmt: skip


def _scatter(residual: Array, state: Array, time: Array) -> float:
    """Return the standard deviation of the residual between visits of nearly the same state."""
    width = np.std(state, axis=0)
    moving = width > 1e-9 * np.maximum(np.max(np.abs(state), axis=0), 1e-30)
    scaled = state[:, moving] / width[moving]
    near = cKDTree(scaled).query(scaled, k=min(NEIGHBOURS, len(scaled)))[1]
    again = np.abs(time[near] - time[:, None]) > AGAIN
    revisited = again.any(axis=1)
    other = near[np.arange(len(near)), np.argmax(again, axis=1)]
    apart = (residual - residual[other])[revisited]
    # without a second visit, noise and missing terms cannot be separated
    return float(np.sqrt(0.5 * np.mean(apart**2))) if revisited.any() else float("inf")
