"""Flow meters of a bench, in addition to the emulator's channels.

They have the same effects as every transducer. Their readings are computed with the signal chain of
the model's first channel, after scaling to its span.
"""

import copy
from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import SPANS, Array
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import SAMPLED


def with_meters(model: PlantModel, flows: Sequence[str]) -> PlantModel:
    """Return a model whose channels include flow meters, after the others.

    Args:
        model: without flow meters.
        flows: names of the metered flows.

    """
    metered = copy.copy(model)
    metered.names = (*model.names, *flows)
    metered.chan = np.concatenate([model.chan, *(model.transducer(name, {}) for name in flows)])
    return metered


class Meter:
    """One flow meter.

    Args:
        model: with its channel, see `with_meters`.
        name: of the flow.

    """

    def __init__(self, model: PlantModel, name: str) -> None:
        self._model, self._signal = model, model.signal_names.index(CHANNELS[0].signal)
        self._scale = CHANNELS[0].span / SPANS[name]
        fields = model.kernel.channel.names or ()
        first = model.names.index(name) * len(fields)
        self._row = slice(first, first + len(fields))
        spans = {e.field_of(p) for e in model.effects if e.stage in SAMPLED for p in e.params
                 if p.unit == "span"}  # fmt: skip
        self._units = np.array([self._scale if field in spans else 1.0 for field in fields])
        self._ideal = model.chan[self._row].copy()

    def reading(self, flow: Array, chan: Array, period: float) -> Array:
        """Return the readings of the meter.

        Args:
            flow: at every sample [m^3/s].
            chan: parameters of all transducers.
            period: of the samples [s].

        """
        row = chan[self._row]
        if np.array_equal(row, self._ideal, equal_nan=True):
            return flow
        model, count = self._model, len(CHANNELS)
        par = np.concatenate([row * self._units, self._model.chan[len(row) : count * len(row)]])
        signals, path = np.zeros(len(model.signal_names)), np.empty((0, count))
        memory = np.full(model.remembered[1], np.nan)
        past = np.full(model.remembered[2], np.nan)
        reading, overrange = np.zeros(count), np.zeros(count, np.int64)
        shown, normal = np.empty(len(flow)), np.zeros(count)
        for k, value in enumerate(flow * self._scale):
            signals[self._signal] = value
            model.kernel.sense(signals, path, par, memory, past, normal, period, reading, overrange)
            shown[k] = reading[0]
        return shown / self._scale
