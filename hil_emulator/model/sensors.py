"""The quantity of each sensor channel, and the common transducer chain.

A channel's element follows its quantity through every step of the integrator; the chain from the
element's output to the reading runs once per sample.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hil_emulator.model.stages import element, element_acts, transducer


@dataclass(frozen=True)
class Channel:
    """One sensor channel.

    Attributes:
        name: channel and dictionary object.
        signal: the model's signal that it measures.
        unit: SI unit.
        shown: the unit engineers write it in.
        span: width of a usual measuring range, in `unit`.
        neighbour: the signal that cross-talk mixes in.
        neighbour_span: its usual range, in its own unit.
        differenced: the channel whose reading an estimator differentiates.

    """

    name: str
    signal: str
    unit: str
    shown: str
    span: float
    neighbour: str
    neighbour_span: float
    differenced: str = ""


CHANNELS = (
    Channel("pressure_a", "pressure_a", "Pa", "bar", 250e5, "pressure_b", 250e5),
    Channel("pressure_b", "pressure_b", "Pa", "bar", 250e5, "pressure_a", 250e5),
    Channel("supply_pressure", "supply_pressure", "Pa", "bar", 250e5, "pressure_b", 250e5),
    Channel("position", "position", "m", "mm", 0.08, "load_force", 10000.0),
    Channel("load_force", "load_force", "N", "N", 10000.0, "transverse_force", 10000.0),
    Channel("velocity", "velocity", "m/s", "m/s", 2.0, "load_force", 10000.0, "position"),
    Channel("spool_position", "spool_position", "A", "mA", 0.02, "supply_pressure", 250e5),
)


def wiring(signals: Sequence[str]) -> np.ndarray[Any, Any]:
    """Return the connections of the channels, for a model with these signals.

    Returns:
        Per channel: the index of its signal, its span, the index of the neighbour's signal, the
        neighbour's span, the index of the differenced channel; shape (channels, 5).

    """
    names = [c.name for c in CHANNELS]
    return np.array(
        [
            (signals.index(c.signal), c.span, signals.index(c.neighbour), c.neighbour_span,
             names.index(c.differenced or c.name))
            for c in CHANNELS
        ]
    )  # fmt: skip


class Transducers(NamedTuple):
    """Records of the transducers, each of shape (channels,).

    Attributes:
        par: their parameters.
        memory: their stored numbers.
        past: their stored samples.

    """

    par: Any
    memory: Any
    past: Any


def observe(y: Any, row: Any) -> None:
    """Stand in for the compiled function that fills a row with each actuator's quantities."""
    raise TypeError("'observe' runs only in the module that kernel.build makes")


def sample(
    signals: Any, path: Any, wires: Any, chain: Transducers, normal: Any, period: float,
    reading: Any, overrange: Any,
) -> None:  # fmt: skip
    """Read every channel once.

    Args:
        signals: the model's signals, shape (signals,).
        path: the channels' quantities at equal intervals since the last sample, the latest last,
            shape (intervals, channels); without a row only the present values are used.
        wires: see `wiring`, shape (channels, 5).
        chain: the transducers.
        normal: standard normal numbers, shape (channels,).
        period: time since the last sample [s].
        reading: readings of the sensors, shape (channels,); overwritten.
        overrange: -1 at the lower end of the measuring range, +1 at the upper end, else 0.

    """
    par, memory, past = chain
    for i in range(len(wires)):
        shown = signals[int(wires[i, 0])]
        if element_acts(par[i]):
            for row in range(len(path)):
                shown = element(
                    par[i], memory[i], memory[i], past[i], path[row, i], period / len(path)
                )
            if len(path) == 0:
                shown = element(par[i], memory[i], memory[i], past[i], shown, period)
        neighbour = signals[int(wires[i, 2])] / wires[i, 3]
        differenced = reading[int(wires[i, 4])]
        value = transducer(
            par[i], memory[i], memory[i], past[i], shown, wires[i, 1], neighbour, differenced,
            period, normal[i],
        )  # fmt: skip
        reading[i] = value
        overrange[i] = 0
        if value >= par[i].measuring_range_upper:
            overrange[i] = 1
        elif value <= par[i].measuring_range_lower:
            overrange[i] = -1
