"""Quantities with units, such as "160 bar", to SI numbers and back."""

import math
from functools import cache

import pint

_WORDS = {
    "Pa": "pressure",
    "m": "length",
    "m^2": "area",
    "m^3": "volume",
    "m^3/s": "flow",
    "m/s": "velocity",
    "A": "current",
    "N": "force",
    "kg": "mass",
    "s": "time",
    "Hz": "frequency",
    "K": "temperature",
    "1": "plain number",
}


@cache
def _registry() -> pint.UnitRegistry[float]:
    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=":auto:")


def _dimension(unit: str) -> str:
    """Return a word or formula for what a unit measures."""
    dimensionality = _registry().Quantity(1.0, unit).dimensionality
    for known, word in _WORDS.items():
        if _registry().Quantity(1.0, known).dimensionality == dimensionality:
            return word
    return f"quantity in {unit}"


def to_si(text: object, unit: str, example: str = "") -> float:
    """Return the number of `unit` in a quantity such as "7.5 l/min".

    Args:
        text: what the user wrote; a bare number is accepted only where `unit` is "1".
        unit: SI unit of the result.
        example: a correct way to write it, for the message.

    Raises:
        ValueError: for anything that is not a finite or infinite number of the right dimension.

    """
    hint = f', such as "{example}"' if example else ""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise ValueError(f"{text!r} is not a quantity; a {_dimension(unit)} is wanted{hint}")
    if not isinstance(text, str) and unit != "1":
        raise ValueError(f"{text!r} has no unit; write it as text with a unit{hint}")
    try:
        quantity = _registry().Quantity(text)
        value = float(quantity.to(unit).magnitude)
    except pint.DimensionalityError:
        found = _dimension(str(quantity.units)) if not quantity.unitless else "plain number"
        raise ValueError(f'"{text}" is a {found}; a {_dimension(unit)} is wanted{hint}') from None
    except Exception:  # pint answers a malformed text with many kinds of exception
        raise ValueError(f'"{text}" cannot be read as a {_dimension(unit)}{hint}') from None
    if math.isnan(value):
        raise ValueError(f'"{text}" is not a number')
    return value


def factor(unit: str, shown: str) -> float:
    """Return how many SI `unit` one `shown` unit is; both must be without offset."""
    return float(_registry().Quantity(1.0, shown).to(unit).magnitude)


def show(value: float, unit: str, shown: str = "") -> str:
    """Return an SI value as people write it: `show(1.6e7, "Pa", "bar")` is "160 bar"."""
    target = shown or unit
    if math.isinf(value):
        return "unlimited" if value > 0.0 else "-unlimited"
    number = float(_registry().Quantity(value, unit).to(target).magnitude)
    return f"{number:.6g}" if target == "1" else f"{number:.6g} {target}"
