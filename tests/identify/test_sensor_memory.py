"""Corrections of the state shift the memory of delayed sensors."""

import numpy as np
import pytest
from rig_data import INSTRUMENTS, OFF, knee_model, recorded

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.observer.observer import Observer


def innovations(field: str, value: float) -> Array:
    """Return the innovations of the position, with a correct model of its sensor."""
    model = knee_model()
    data = recorded({}, "multisine", 3, sensors={"position": {field: value}})
    par, chan = model.par.copy(), model.chan.copy()
    for name, factor in OFF.items():
        par[list(model.kernel.parameters.names or ()).index(name)] *= factor
    names = list(model.kernel.channel.names or ())
    chan[model.names.index("position") * len(names) + names.index(field)] = value
    observer = Observer(model, INSTRUMENTS)
    frozen = observer.freeze(data, par, chan)
    innovations, _ = observer.innovations(frozen, par, chan)
    return np.asarray(innovations[~frozen.data.settling, INSTRUMENTS.index("position")])


def from_row_to_row(values: Array) -> float:
    """Return the correlation of successive values."""
    return float(np.mean(values[1:] * values[:-1]) / np.mean(values**2))


@pytest.mark.parametrize("field", ["delay_time", "lag_time_constant"])
def test_a_delayed_reading_repeats_no_correction(field: str) -> None:
    """With a delay of 4 ms, the innovations are hardly correlated.

    Without the shift of the memory, the correlation would be larger by 0.2.
    """
    late, prompt = (from_row_to_row(innovations(field, value)) for value in (4e-3, 0.0))
    print(f"{prompt:.3f}, late {late:.3f}")
    assert late - prompt < 0.1
