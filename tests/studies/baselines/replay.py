"""Residuals of recordings by three usual ways of comparing a model with them.

Open loop simulates a whole recording from its start. Multiple shooting starts anew from smoothed
measurements every 200 ms. Equation error starts anew at every sample, from smoothed measurements of
every state that was measured; the spool alone is simulated. None of them knows that the null and
the supply drift.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.ndimage import gaussian_filter1d

from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.filter.sensor_replay import HIDDEN
from hil_emulator.identify.prediction.model_run.records import Data, Gains, Start
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel

Way = Literal["open loop", "multiple shooting", "equation error"]

CHANNELS = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")

STRETCH = 0.2
"""Length of a shot [s]."""

SMOOTHING = 6e-3
"""Standard deviation of the Gaussian that smooths measurements [s]."""

SETTLING = 0.02
"""Time at the start of a stretch that counts for nothing: the spool's start is a guess [s]."""

WORST = 1e3
"""Largest residual, in steps of the residual's own spread at first."""


@dataclass(frozen=True)
class Stretch:
    """A piece of a recording that is simulated in one go."""

    period: float
    current: np.ndarray
    measured: np.ndarray
    start: np.ndarray
    gains: np.ndarray
    settling: int


class Replay:
    """Computes residuals in one of the three ways.

    Args:
        model: the model.
        experiments: the recordings; all channels of `CHANNELS` must be there.
        way: how they are compared.

    """

    def __init__(self, model: PlantModel, experiments: Sequence[Experiment], way: Way) -> None:
        self.model, self.way = model, way
        self._period = experiments[0].period
        self._smoothed = way == "equation error"
        self.channels = (*CHANNELS, "velocity") if way == "equation error" else CHANNELS
        self._observer = Observer(model, self.channels)
        self._names = list(model.kernel.state.names or ())
        self._active = np.array([self._names.index(n) for n in model.active(model.par)])
        self._stretches = [s for e in experiments for s in self._cut(e)]

    @property
    def independent(self) -> float:
        """Share of the samples that are independent after smoothing; one without."""
        return self._period / (2.0 * math.sqrt(math.pi) * SMOOTHING) if self._smoothed else 1.0

    def residual(self, coordinates: Sequence[Coordinate], at: Sequence[float]) -> np.ndarray:
        """Return measured minus simulated, shape (samples, channels), over the spans' scale."""
        par, chan = self.model.memory(coordinates, at)
        step = self._observer.steps.width(par)
        rows = [self._simulated(s, par, chan, step)[s.settling :] for s in self._stretches]
        return np.asarray(np.nan_to_num(np.vstack(rows), nan=WORST, posinf=WORST, neginf=-WORST))

    def _simulated(self, s: Stretch, par: Any, chan: Any, step: float) -> np.ndarray:
        model, count = self.model, len(s.current)
        steps = max(1, int(np.ceil(s.period / step - 1e-9)))
        scale = np.diag(1.0 / self._scales())
        residual = np.empty_like(s.measured)
        z0 = np.concatenate([s.start[self._active], [0.0, 0.0]])
        model.loops.predict(
            model.at(par, chan, s.period / steps, steps),
            Data(
                s.current[:, None], np.zeros(count), s.measured, self._observer.chosen, s.period,
                np.zeros(count, np.bool_),
            ),
            Start(s.start, z0, self._active, np.ones(2)),
            Gains(s.gains, np.tile(scale, (count, 1, 1)).astype(np.float32)), residual,
            np.empty((1, len(model.signal_names))), HIDDEN,
        )  # fmt: skip
        return np.clip(residual, -WORST, WORST)

    def _scales(self) -> np.ndarray:
        """Return a usual noise of each channel, SI: only the units of the residual."""
        sizes = {"position": 1e-5, "load_force": 15.0, "velocity": 1e-3}
        return np.array([sizes.get(c, 3e4) for c in self.channels])

    def _cut(self, e: Experiment) -> list[Stretch]:
        measured, current = e.matrix(CHANNELS), e.current
        smooth = gaussian_filter1d(measured, SMOOTHING / e.period, axis=0)
        velocity = np.gradient(smooth[:, 3], e.period)
        if self._smoothed:
            measured = np.column_stack([smooth, velocity])
            current = gaussian_filter1d(current, SMOOTHING / e.period)
        length = round(STRETCH / e.period) if self.way == "multiple shooting" else len(measured)
        whole = Stretch(e.period, current, measured, np.zeros(0), self._gains(len(measured)),
                        round(SETTLING / e.period))  # fmt: skip
        states = np.column_stack([smooth, velocity, current])
        return [
            replace(whole, current=current[i : i + length], measured=measured[i : i + length],
                    start=self._start(states[i]), gains=whole.gains[i : i + length])
            for i in range(0, len(measured) - length + 1, length)
        ]  # fmt: skip

    def _start(self, row: np.ndarray) -> np.ndarray:
        """Return the state that belongs to smoothed measurements; the spool follows at once."""
        start = self.model.start(self.model.par, self._observer.steps.largest, (row[0], row[1]))
        for name, value in (("position", row[3]), ("velocity", row[5]), ("spool_position", row[6])):
            start[self._names.index(name)] = value
        return start

    def _gains(self, samples: int) -> np.ndarray:
        """Return gains that replace measured states at every sample, or zero ones."""
        gains = np.zeros((samples, len(self._active) + 2, len(self.channels)))
        if self._smoothed:
            for name in ("pressure_a", "pressure_b", "position", "velocity"):
                row = list(self._active).index(self._names.index(name))
                gains[:, row, self.channels.index(name)] = 1.0
        return gains
