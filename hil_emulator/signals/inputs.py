"""What can be set during a run: conditions of the surroundings, and the set point itself."""

import dataclasses
from collections.abc import Mapping

from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.model.declare import Param
from hil_emulator.model.quantities import PARAMS
from hil_emulator.units import read_as, show, to_si

(_SUPPLY,) = (p for p in PARAMS["supply"] if p.name == "pressure")
(_CLOSED,) = (p for p in PARAMS["lines"] if p.name == "closed")

SETTINGS = {
    p.name: p
    for p in (
        dataclasses.replace(_SUPPLY, name="supply_pressure"),
        dataclasses.replace(_CLOSED, name="lines_closed"),
        Param("external_force", "N", "further force against the load", 0.0, -1e8, 1e8),
        Param(
            "wall_shift",
            "m",
            "displacement of the wall of [load] from its distance",
            0.0,
            -10.0,
            10.0,
            "mm",
        ),
        Param("valve_current", "A", "set point of the coil current", 0.0, -10.0, 10.0, "mA"),
    )
}
"""Settings with their units and bounds. The valve current is written into the node's set point
object, as an SDO client does: it is in force while the node is OPERATIONAL, until the next RPDO;
the object has limits of its own."""

COMMANDS = ("valve_current",)
"""Settings that nodes command the plant to do, and may refuse."""

OF_SUPPLY = ("supply_pressure",)
"""Settings of the supply, which several actuators may share."""

SET_POINTS = {
    p.name: p
    for p in (
        Param("position", "m", "set point of the position of the rod", 0.04, 0.0, 10.0, "mm"),
        Param("load_force", "N", "set point of the force between rod and load", 0.0, -1e8, 1e8),
        Param(
            "valve_current",
            "A",
            "set point of the coil current",
            0.0,
            -10.0,
            10.0,
            "mA",
        ),
    )
}
"""Set points of a controller; one of them is active at a time."""


def setting(name: str, value: object, settings: Mapping[str, Param] = SETTINGS) -> float:
    """Return the value of a setting in SI.

    Args:
        name: of the setting.
        value: a quantity as the user writes it.
        settings: declarations of the settings, by name.

    Raises:
        UserError: for an unknown setting, a wrong unit or a value out of bounds.

    """
    param = _param(name, settings)
    try:
        number = to_si(value, param.unit, difference=param.difference)
    except ValueError as error:
        raise UserError(f"{name}: {error}") from None
    return _within(param, number, brief(value))


def shown(param: Param, value: float) -> str:
    """Return a value of a setting as people write it."""
    return show(value, param.unit, read_as(param.unit, param.display_unit))


def checked(name: str, value: float) -> float:
    """Return the value of a setting that is in SI already.

    Raises:
        UserError: for an unknown setting, no number, or a value out of bounds.

    """
    param = _param(name, SETTINGS)
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise UserError(f"{name}: {brief(value)} is not a number in {param.unit}") from None
    return _within(param, number, f"{number:g} {param.unit}")


def _param(name: str, settings: Mapping[str, Param]) -> Param:
    if name not in settings:
        raise UserError(f"no setting '{brief(name)}'{did_you_mean(name, settings)}")
    return settings[name]


def _within(param: Param, number: float, written: str) -> float:
    if not param.allows(number):
        low, high = (shown(param, v) for v in (param.low, param.high))
        raise UserError(f"{param.name}: {written} is outside {low} ... {high}")
    return number
