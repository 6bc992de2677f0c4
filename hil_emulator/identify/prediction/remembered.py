"""Where sensors remember positions of the rod: in filters, and as samples that a law looks back on.

A correction of the position holds for what was read before, too; see `run.correct`.
"""

import inspect

import numpy as np

from hil_emulator.identify.measured.experiment import Index
from hil_emulator.model.declare import Effect
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import length
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import element, transducer

POSITION = "position"
"""The channel, and what a channel that differences it looks at."""


def remembered_positions(kernel: Kernel) -> tuple[Index, list[tuple[int, Index]]]:
    """Return the places in a kernel's memory of sensors that hold positions.

    Returns:
        Indices in what all channels remember; and for each law that looks back on samples, the
        index of its knob among the parameters of all channels, zero where it is off, and indices in
        the samples that all channels remember.

    """
    names = [c.name for c in CHANNELS]
    traced = [_at(kernel.memory, names.index(POSITION), e.field_of(q))
              for e in kernel.effects if e.stage is element
              for q in e.states if q.unit == "span"]  # fmt: skip
    histories = []
    for e in (e for e in kernel.effects if e.stage is transducer):
        for q in (q for q in e.states if q.length > 1):
            row = _channel_of(e)
            knob = int(_at(kernel.channel, row, e.field_of(e.knob))[0])
            histories.append((knob, _at(kernel.channel_past, row, e.field_of(q))))
    return np.concatenate(traced or [np.zeros(0, np.int64)]), histories


def _channel_of(effect: Effect) -> int:
    """Return the channel in which a law looks back on positions: that of a rate if it derives."""
    if "differenced" in inspect.signature(effect.law).parameters:
        return next(i for i, c in enumerate(CHANNELS) if c.differenced == POSITION)
    return next(i for i, c in enumerate(CHANNELS) if c.name == POSITION)


def _at(layout: np.dtype[np.void], channel: int, field: str) -> Index:
    """Return the indices of a channel's field in the memory of all channels."""
    assert layout.fields is not None
    kind, offset = layout.fields[field][:2]
    first = channel * length(layout) + offset // 8
    return np.arange(first, first + kind.itemsize // 8)
