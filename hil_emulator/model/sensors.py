"""Which quantity each sensor channel shows, and the transducer chain they share."""

from dataclasses import dataclass
from typing import Any

from hil_emulator.model.stages import transducer


@dataclass(frozen=True)
class Channel:
    """What one sensor reports.

    Attributes:
        name: channel and dictionary object.
        signal: the model's signal that it measures.
        unit: SI unit.
        shown: the unit engineers write it in.
        span: width of a usual measuring range, in `unit`.

    """

    name: str
    signal: str
    unit: str
    shown: str
    span: float


CHANNELS = (
    Channel("pressure_a", "pressure_a", "Pa", "bar", 250e5),
    Channel("pressure_b", "pressure_b", "Pa", "bar", 250e5),
    Channel("supply_pressure", "supply_pressure", "Pa", "bar", 250e5),
    Channel("position", "position", "m", "mm", 0.08),
    Channel("load_force", "load_force", "N", "N", 10000.0),
)


def sample(
    signals: Any, sources: Any, par: Any, memory: Any, normal: Any, period: float, reading: Any,
    overrange: Any,
) -> None:  # fmt: skip
    """Read every channel once.

    Args:
        signals: the model's signals, shape (signals,).
        sources: index of each channel's signal, shape (channels,).
        par: records of the channels' transducer parameters, shape (channels,).
        memory: records of what the channels remember, shape (channels,).
        normal: standard normal numbers, shape (channels,).
        period: time since the last sample [s].
        reading: what the sensors report, shape (channels,); overwritten.
        overrange: -1 at the lower end of the measuring range, +1 at the upper one, else 0.

    """
    for i in range(len(sources)):
        value = transducer(par[i], memory[i], memory[i], signals[sources[i]], period, normal[i])
        reading[i] = value
        overrange[i] = 0
        if value >= par[i].measuring_range_upper:
            overrange[i] = 1
        elif value <= par[i].measuring_range_lower:
            overrange[i] = -1
