"""Whether what a model leaves is chance, or comes again whenever the rod is in the same state.

Where a bench repeats its strokes, the scatter of the residual between visits of one state is what
no model of that state could explain: the pure error of a test for lack of fit (Fisher 1922; for
near replicates Daniel and Wood 1980, section 7). What is left beyond it is missing in the model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hil_emulator.identify.disagreement.gap import View
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.predictor import Predictor

STATES = ("position", "velocity", "pressure_a", "pressure_b")
"""What a visit is like."""

MOST = 20_000
"""Samples that are compared; of longer recordings, evenly chosen ones."""

NEIGHBOURS = 32
"""Nearest samples among which one of another visit is looked for."""

AGAIN = 0.5
"""Time from which a state was visited again, rather than not left yet [s] (assumed)."""

REPEATING = 0.5
"""Part of the residual's variance that comes again, from which most of it is no chance: neither the
sensors' noise nor what the bench does not repeat, which both differ from visit to visit."""


@dataclass(frozen=True)
class Repeatability:
    """What a model leaves, and how much of it comes again.

    Attributes:
        channel: which reading it is about.
        rms: root mean square of the residual, in `unit`.
        scatter: standard deviation between visits of one state.
        spread: standard deviation of the readings.
        unit: of these.

    """

    channel: str
    rms: float
    scatter: float
    spread: float
    unit: str

    @property
    def share(self) -> float:
        """Part of the residual's variance that comes again."""
        return max(0.0, 1.0 - (self.scatter / self.rms) ** 2) if self.rms > 0.0 else 0.0

    @property
    def unexplained(self) -> bool:
        """Whether most of it comes again."""
        return self.share > REPEATING

    def __str__(self) -> str:
        return (
            f"cannot tell what is missing: {self.rms:.3g} {self.unit} rms of the "
            f"{self.channel.replace('_', ' ')} stay unexplained ({self.rms / self.spread:.0%} of "
            f"its spread), and {self.share:.0%} of their variance comes again whenever the rod is "
            "in the same state; no effect in the catalogue explains that with certainty"
        )


def repeatability(predictor: Predictor, views: Sequence[View]) -> Repeatability:
    """Return what comes again of the residual of a predictor's only channel."""
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
    found = again.any(axis=1)
    other = near[np.arange(len(near)), np.argmax(again, axis=1)]
    apart = (residual - residual[other])[found]
    # without any second visit nothing tells chance from what is missing
    return float(np.sqrt(0.5 * np.mean(apart**2))) if found.any() else float("inf")
