"""Memory of the sensors (filters and past samples) that corrections of the state shift as well.

See `run.correct`.
"""

import inspect
from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Index
from hil_emulator.model.declare import Effect, Quantity
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import length
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import element, transducer


class SensorMemory(NamedTuple):
    """Memory of one effect of a channel.

    Attributes:
        effect: of a transducer.
        channel: index of the channel of the quantity.
        knob: index of the knob among the parameters of all channels.
        places: indices in the memory of all channels.

    """

    effect: Effect
    channel: int
    knob: int
    places: Index


def followed(kernel: Kernel) -> list[SensorMemory]:
    """Return the filter memories of the channels' sensing elements."""
    memories = []
    for e in (e for e in kernel.effects if e.stage is element):
        states = [q for q in e.states if q.unit == "span"]
        memories += [_remembered(kernel, e, i, kernel.memory, states) for i in range(len(CHANNELS))]
    return memories


def recorded(kernel: Kernel) -> list[SensorMemory]:
    """Return the memories of past samples that laws use."""
    memories, names = [], [c.name for c in CHANNELS]
    for e in (e for e in kernel.effects if e.stage is transducer):
        states = [q for q in e.states if q.length > 1]
        derives = "differenced" in inspect.signature(e.law).parameters
        for i, channel in enumerate(CHANNELS if states else ()):
            one = _remembered(kernel, e, i, kernel.channel_past, states)
            if not derives:
                memories.append(one)
            elif channel.differenced:
                memories.append(one._replace(channel=names.index(channel.differenced)))
    return memories


def _remembered(
    kernel: Kernel, effect: Effect, channel: int, layout: np.dtype[np.void], states: list[Quantity]
) -> SensorMemory:
    knob = _at(kernel.channel, channel, effect.field_of(effect.knob))
    places = [_at(layout, channel, effect.field_of(q)) for q in states]
    return SensorMemory(effect, channel, int(knob[0]), np.concatenate(places))


def _at(layout: np.dtype[np.void], channel: int, field: str) -> Index:
    """Return the indices of a channel's field in the memory of all channels."""
    assert layout.fields is not None
    kind, offset = layout.fields[field][:2]
    first = channel * length(layout) + offset // 8
    return np.arange(first, first + kind.itemsize // 8)
