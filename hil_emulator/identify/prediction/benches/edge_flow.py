"""Flow through the metering edges of the configured valve, for arrays of samples."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.model.servo_valve import transition

SHUT = 1e-12
"""Opening below which an edge counts as shut [A] (assumed)."""


def through_edge(opening: Array, drop: Array, plant: Mapping[str, float]) -> Array:
    """Return the flow through one edge, the law of `model.servo_valve.edge_flow` [m^3/s].

    Args:
        opening: in ampere; an edge below zero is shut.
        drop: pressure over it [Pa].
        plant: parameters of the plant by record field, SI.

    """
    product: float = transition(SimpleNamespace(**plant), 1.0)
    laminar = (product / np.maximum(opening, SHUT)) ** 2
    bent = np.sqrt(np.hypot(np.hypot(drop, laminar), plant["valve_laminar_width"]))
    return np.asarray(plant["valve_gain"] * np.maximum(opening, 0.0) * drop / bent)
