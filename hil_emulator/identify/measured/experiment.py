"""One experiment on a uniform time grid: the input of the predictor."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hil_emulator.model.sensors import CHANNELS

Array = np.ndarray[Any, np.dtype[np.float64]]
Single = np.ndarray[Any, np.dtype[np.float32]]
Mask = np.ndarray[Any, np.dtype[np.bool_]]
Index = np.ndarray[Any, np.dtype[np.int64]]

FLOW = "flow_a"
"""Flow out of the valve's port a; a bench may measure it, the emulator has no such channel."""

FLOWS = (FLOW, "flow_b", "supply_flow", "return_flow", "leakage_line_flow")
"""Flows that a bench may measure: out of the valve's port a, into its port b, through its ports s
and t, and through a separate leakage line."""

REFERENCE = "position_reference"
"""Set point of the position in a closed loop."""

_SHOWN = {channel.name: (channel.unit, channel.span) for channel in CHANNELS}
_SHOWN |= dict.fromkeys(FLOWS, ("m^3/s", 1e-3)) | {REFERENCE: ("m", 0.08)}

UNITS = {name: unit for name, (unit, _) in _SHOWN.items()}
SPANS = {name: span for name, (_, span) in _SHOWN.items()}


@dataclass(frozen=True)
class BetweenRows:
    """Course of a set point between the rows of its recording.

    Attributes:
        current: in equal parts of each period, shape (rows, parts) [A].
        unknown: variance of its mean over each period, shape (rows,) [A^2].
        jumps: whether it jumped within a period, at an unknown time, shape (rows,).

    """

    current: Array
    unknown: Array
    jumps: Mask


@dataclass(frozen=True)
class Experiment:
    """Recorded set points and readings.

    Attributes:
        name: of its file, and the part of it.
        period: sample period [s].
        current: valve current that acts from each sample to the next [A]; empty if unknown.
        readings: values by channel, SI, NaN where a reading is missing.
        notes: faults of the data, and repairs.
        digest: digest of the file.
        set_point_first: whether a row's current is that at the end of its period, not the start.
        order_assumed: whether the file does not state whether a row's current acted before or after
            its readings.
        course: of the current between the rows; None if it was held.
        copies: number of experiments with the same noise, itself included; see `shared_noise`.

    """

    name: str
    period: float
    current: Array
    readings: dict[str, Array]
    notes: tuple[str, ...] = ()
    digest: str = ""
    set_point_first: bool = False
    order_assumed: bool = False
    course: BetweenRows | None = None
    copies: int = 1

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(next(iter(self.readings.values()))) if self.readings else len(self.current)

    @property
    def currents(self) -> BetweenRows:
        """The current in every part of a period: a single part if it was held."""
        rows = len(self.current)
        held = BetweenRows(self.current[:, None], np.zeros(rows), np.zeros(rows, np.bool_))
        return self.course or held

    def between(self, begin: int, end: int) -> "Experiment":
        """Return the samples from one to before another, as an experiment."""
        rows, course = slice(begin, end), self.course
        if course is not None:
            course = BetweenRows(course.current[rows], course.unknown[rows], course.jumps[rows])
        readings = {name: values[rows] for name, values in self.readings.items()}
        return replace(self, current=self.current[rows], readings=readings, course=course)

    def matrix(self, channels: tuple[str, ...]) -> Array:
        """Return the readings, shape (samples, channels)."""
        empty = np.full(self.samples, np.nan)
        return np.column_stack([self.readings.get(name, empty) for name in channels])


def noise_of(values: Array) -> float:
    """Return the standard deviation of white noise on a smooth signal, from sixth differences.

    A short rough part of the signal hardly changes the median. The sixth difference has 924 times
    the variance of white noise, and removes frequencies below a tenth of the sample rate.
    """
    finite = values[np.isfinite(values)]
    if len(finite) < 16:
        return 0.0
    sixth = np.diff(finite, 6)
    return float(np.median(np.abs(sixth)) / 0.6745 / np.sqrt(924.0))
