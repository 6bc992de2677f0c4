"""One experiment on a uniform time grid: what the predictor takes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from hil_emulator.model.sensors import CHANNELS

Array = np.ndarray[Any, np.dtype[np.float64]]
Single = np.ndarray[Any, np.dtype[np.float32]]
Mask = np.ndarray[Any, np.dtype[np.bool_]]
Index = np.ndarray[Any, np.dtype[np.int64]]

FLOW = "flow_a"
"""Flow out of the valve's port a, as a bench measures it and no channel of the emulator shows."""

FLOWS = (FLOW, "flow_b", "supply_flow", "return_flow", "leakage_line_flow")
"""Flows that a bench meters: out of the valve's port a, into its port b, through its ports s and t,
and what leaves by a line of its own."""

REFERENCE = "position_reference"
"""What a closed loop wants the position to be."""

_SHOWN = {channel.name: (channel.unit, channel.span) for channel in CHANNELS}
_SHOWN |= dict.fromkeys(FLOWS, ("m^3/s", 1e-3)) | {REFERENCE: ("m", 0.08)}

UNITS = {name: unit for name, (unit, _) in _SHOWN.items()}
SPANS = {name: span for name, (_, span) in _SHOWN.items()}


@dataclass(frozen=True)
class BetweenRows:
    """What a set point did between the rows of its recording.

    Attributes:
        current: in equal parts of each period, shape (rows, parts) [A].
        unknown: variance by which its mean over a period may be another one, shape (rows,) [A^2].
        jumps: whether it jumped within a period, nobody knows when, shape (rows,).

    """

    current: Array
    unknown: Array
    jumps: Mask


@dataclass(frozen=True)
class Experiment:
    """Recorded set points and readings.

    Attributes:
        name: where it comes from.
        period: sample period [s].
        current: valve current that acts from each sample to the next [A]; empty if unknown.
        readings: values by channel, SI, NaN where nothing was recorded.
        notes: what was found and repaired on the way in.
        digest: digest of the file.
        set_point_first: whether a current is that at the end of its period, not the beginning.
        order_assumed: whether the file does not state whether a row's current acted before or after
            its readings.
        course: what it did in between; None where it was held.
        copies: experiments that share its noise, itself included; see `copies`.

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
        """The current in every part of a period: one part where it was held."""
        rows = len(self.current)
        held = BetweenRows(self.current[:, None], np.zeros(rows), np.zeros(rows, np.bool_))
        return self.course or held

    def matrix(self, channels: tuple[str, ...]) -> Array:
        """Return the readings, shape (samples, channels)."""
        empty = np.full(self.samples, np.nan)
        return np.column_stack([self.readings.get(name, empty) for name in channels])


def noise_of(values: Array) -> float:
    """Return the standard deviation of white noise on a smooth signal, from sixth differences.

    The median deviates little where the signal is rough for a short time. A sixth difference of
    white noise has 924 times its variance, and takes away what moves below a tenth of the rate.
    """
    finite = values[np.isfinite(values)]
    if len(finite) < 16:
        return 0.0
    sixth = np.diff(finite, 6)
    return float(np.median(np.abs(sixth)) / 0.6745 / np.sqrt(924.0))
