"""The columns of a recording: what is read by name, with its unit."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from hil_emulator.model.actuator import INPUTS, SIGNALS
from hil_emulator.model.plant import Plant
from hil_emulator.model.sensors import CHANNELS

MODEL = "model."
"""Prefix of the model's own signals, which no sensor adds its errors to."""


Readings = Sequence[float] | np.ndarray[Any, np.dtype[np.float64]]
"""One reading per sensor channel."""


@cache
def columns() -> dict[str, str]:
    """Return the columns of a recording, name to SI unit.

    Time, set points, then what the sensors report, then the model's own signals.
    """
    return (
        {"time": "s"}
        | {q.name: q.unit for q in INPUTS}
        | {c.name: c.unit for c in CHANNELS}
        | {MODEL + q.name: q.unit for q in SIGNALS}
    )


def fill_row(
    row: np.ndarray[Any, np.dtype[np.float64]], now_ns: int, plant: Plant, measured: Readings
) -> None:
    """Write a tick into a row of the width of `columns()`."""
    first = 1 + len(plant.input_vector)
    second = first + len(measured)
    row[0] = now_ns * 1e-9
    row[1:first] = plant.input_vector
    row[first:second] = measured
    row[second:] = plant.signal_vector
