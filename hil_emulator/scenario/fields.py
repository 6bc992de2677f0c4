"""Types of a scenario's keys: what a file holds is read into SI and checked."""

from typing import Annotated

from pydantic import BeforeValidator

from hil_emulator.config.table import QuantityReader
from hil_emulator.errors import UserError, brief, did_you_mean
from hil_emulator.faults.fault import Fault, spoken
from hil_emulator.model.declare import Param
from hil_emulator.signals import condition
from hil_emulator.signals.condition import Condition
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS, setting
from hil_emulator.units import to_si

LONGEST_S = 1e6
"""The longest time of a scenario [s]: twelve days (assumed)."""


def _broken(text: object) -> Fault:
    try:
        return spoken(str(text))
    except UserError as error:
        raise ValueError(str(error)) from None


def _condition(text: object) -> Condition:
    try:
        return condition.parse(str(text))
    except UserError as error:
        raise ValueError(str(error)) from None


def _values(given: object) -> object:
    """Return set points and settings in SI."""
    targets = SETTINGS | SET_POINTS
    wrong = [name for name in given if name not in targets] if isinstance(given, dict) else ["set"]
    if wrong or not isinstance(given, dict):
        raise ValueError(f"unknown key '{brief(wrong[0])}' in set{did_you_mean(wrong[0], targets)}")
    try:
        return {name: setting(name, value, targets) for name, value in given.items()}
    except UserError as error:
        raise ValueError(str(error)) from None


def band(signal: object, within: object) -> tuple[float, ...]:
    """Return the bounds of a signal in SI; zero needs no unit.

    Raises:
        ValueError: for an unknown signal, or bounds that are not two quantities.

    """
    try:
        unit = condition.unit_of(str(signal))
    except UserError as error:
        raise ValueError(str(error)) from None
    low, high = pair(within)
    return tuple(0.0 if bound == 0 else to_si(bound, unit) for bound in (low, high))


def pair(within: object) -> list[object]:
    """Return a list of two values.

    Raises:
        ValueError: for anything else.

    """
    if not isinstance(within, list) or len(within) != 2:
        raise ValueError("within is a list of the lowest and the highest value")
    return within


TIME = Param("time", "s", "time after the start", 0.2, 0.0, LONGEST_S)
Seconds = Annotated[float, QuantityReader(TIME)]
OptionalSeconds = Annotated[float | None, QuantityReader(TIME)]
Broken = Annotated[Fault, BeforeValidator(_broken)]
Holds = Annotated[Condition, BeforeValidator(_condition)]
Values = Annotated[dict[str, float], BeforeValidator(_values)]
