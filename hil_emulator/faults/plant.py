"""Plant and electrical faults: parameters and the coil current in place of the sound ones."""

import functools
import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from hil_emulator.faults.fault import Fault
from hil_emulator.model.plant import Plant

Change = Callable[[float, float], float]
"""Returns a parameter's value from its sound value and the strength of the fault."""

LOWEST_SUPPLY = 1e5
"""A pump at rest: the supply does not fall below the atmosphere [Pa]."""


_CHANGES: dict[tuple[str, str], tuple[str, Callable[[Mapping[str, Any], float, float], float]]] = {
    ("supply", "loss"): (
        "supply_pressure", lambda v, sound, s: sound + s * (v["pressure"] - sound)),
    ("supply", "droop"): (
        "supply_pressure", lambda v, sound, s: max(LOWEST_SUPPLY, sound - s * v["drop"])),
    ("cylinder", "leak"): (
        "internal_leakage_conductance", lambda v, sound, s: sound + s * v["conductance"]),
    ("cylinder", "friction_jump"): (
        "coulomb_friction_force", lambda v, sound, s: sound + s * v["force"]),
    ("oil", "air"): (
        "entrained_air_fraction", lambda v, sound, s: sound + s * v["fraction"]),
    ("valve", "stuck"): (
        "spool_rate_limit_rate", lambda v, sound, s: 0.0 if s else sound),
    ("valve", "clogged"): (
        "valve_gain", lambda v, sound, s: sound * (1.0 - s * v["share"])),
    ("valve", "slow"): (
        "spool_rate_limit_rate", lambda v, sound, s: min(sound, v["rate"] / s) if s else sound),
}  # fmt: skip
"""By target and kind: the parameter, and its value from the fault's values, its sound value and
the strength of the fault."""

FAULTY_PARAMETERS = frozenset(name for name, _ in _CHANGES.values())
"""What faults can change, whether the configuration has it on or off."""


def parameter_change(fault: Fault) -> tuple[str, Change]:
    """Return the plant's parameter that a fault changes, and how."""
    name, change = _CHANGES[fault.target, fault.kind.name]
    return name, functools.partial(change, fault.values)


def coil_change(fault: Fault) -> Change:
    """Return how a fault changes the current through the coil."""
    if fault.kind.name == "current_limited":

        def limited(current: float, s: float) -> float:
            limit = fault.values["limit"] / s if s else math.inf
            return max(-limit, min(limit, current))

        return limited
    return lambda current, s: current * (1.0 - s)


class PlantParameters:
    """The plant's parameters with their sound values behind those that faults have changed."""

    def __init__(self, plant: Plant) -> None:
        self._vector = plant.parameter_vector
        self._index = {name: i for i, name in enumerate(plant.kernel.parameters.names or ())}
        self._sound: dict[str, float] = {}

    def sound(self, name: str) -> float:
        """Return the value a parameter has without faults."""
        return self._sound.get(name, float(self._vector[self._index[name]]))

    def set_sound(self, name: str, value: float) -> None:
        """Set the value a parameter has without faults."""
        if name in self._sound:
            self._sound[name] = value
        else:
            self._vector[self._index[name]] = value

    def change(self, values: Mapping[str, float]) -> None:
        """Give parameters faulty values."""
        for name, value in values.items():
            self._sound.setdefault(name, float(self._vector[self._index[name]]))
            self._vector[self._index[name]] = value

    def restore(self, faulty: Collection[str]) -> None:
        """Give all parameters but the `faulty` ones their sound values again."""
        for name in [n for n in self._sound if n not in faulty]:
            self._vector[self._index[name]] = self._sound.pop(name)
