"""Quantities with units, such as "160 bar", to SI numbers and back.

    quantity   number [unit]
    unit       [["1"] "/"] term {("*" | "/" | " ") term}
    term       power or "(" power {("*" | "/" | " ") power} ")" [exponent]
    power      name [exponent]
    exponent   ("^" | "**") ["-"] digit ["." digit]

Only what this grammar lets pass reaches pint, which would evaluate any arithmetic: a quantity is
read, never computed.
"""

import math
import re
from functools import cache

import pint

from hil_emulator.errors import brief

LONGEST = 80
"""Characters of a quantity; the longest unit that is declared has 17 (assumed)."""

_NUMBER = r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)\b)\s*"
_EXPONENT = r"(?:\s*(?:\^|\*\*)\s*-?\d(?:\.\d)?)?"
_POWER = rf"(?:%|°?[A-Za-zµμΩ][A-Za-z0-9_µμΩ]*){_EXPONENT}"
_JOINED = r"(?:\s*[*/·]\s*|\s+)"
_TERM = rf"(?:{_POWER}|\(\s*{_POWER}(?:{_JOINED}{_POWER})*\s*\){_EXPONENT})"
_UNIT = rf"(?:1?\s*/\s*)?{_TERM}(?:{_JOINED}{_TERM})*"
_QUANTITY = re.compile(rf"{_NUMBER}({_UNIT})?\s*", re.ASCII)
_SUPERSCRIPTS = str.maketrans({"²": "^2", "³": "^3"})

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


_COMMON = {
    "Pa": "Pa kPa MPa bar mbar psi",
    "m": "um mm cm m inch ft",
    "m^3/s": "l/min cm^3/s m^3/s m^3/h",
    "A": "uA mA A",
    "N": "N kN MN lbf",
    "kg": "g kg t lb",
    "s": "ns us ms s min h",
    "Hz": "Hz kHz",
}
"""Units that are taken for others by mistake, by what they measure."""


@cache
def _registry() -> pint.UnitRegistry[float]:
    try:
        return pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=":auto:")
    except Exception:  # a folder that cannot be written, or what another process has begun there
        return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@cache
def _words() -> dict[object, str]:
    return {_registry().Unit(known).dimensionality: word for known, word in _WORDS.items()}


def _measured(quantity: pint.Quantity[float], unit: str) -> str:
    """Return a word for what a quantity in a unit is, or else the unit."""
    return _words().get(quantity.dimensionality, f"quantity in {unit}")


@cache
def _dimension(unit: str) -> str:
    return _measured(_registry().Quantity(1.0, unit), unit)


def _read(text: str) -> pint.Quantity[float]:
    """Return the quantity that a text states.

    Raises:
        ValueError: if it is too long, or more than a number and a unit.
        pint.PintError: if there is no such unit.

    """
    match = _QUANTITY.fullmatch(text.translate(_SUPERSCRIPTS)) if len(text) <= LONGEST else None
    if match is None:
        raise ValueError(f"write a number and a unit, at most {LONGEST} characters")
    number, unit = match.groups(default="")
    return _registry().Quantity(float(number), f"1{unit}" if unit.startswith("/") else unit)


@cache
def pattern(unit: str) -> str:
    """Return a regular expression (ECMA 262) of quantities that may be of a unit's dimension.

    It refuses numbers without a unit and common units of other dimensions; what it lets pass,
    `to_si` judges.
    """
    foreign = " ".join(text for known, text in _COMMON.items() if not _alike(known, unit))
    refused = "|".join(re.escape(word) for word in foreign.split())
    number = r"[-+]?(\d+\.?\d*|\.\d+|inf)([eE][-+]?\d+)?"
    unit_text = rf"(?!({refused})\s*$)[%°/(A-Za-zµμΩ].*"
    return rf"^\s*{number}\s*({unit_text}){'?' if _alike(unit, '1') else ''}$"


def _alike(one: str, other: str) -> bool:
    return bool(_registry().Unit(one).dimensionality == _registry().Unit(other).dimensionality)


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
        raise ValueError(f"{brief(text)} is not a quantity; a {_dimension(unit)} is wanted{hint}")
    if not isinstance(text, str) and unit != "1":
        raise ValueError(f"{brief(text)} has no unit; write it as text with a unit{hint}")
    written = f'"{brief(text)}"'
    try:
        quantity = _read(text) if isinstance(text, str) else _registry().Quantity(float(text))
        value = float(quantity.to(unit).magnitude)
    except pint.DimensionalityError:
        found = "plain number" if quantity.unitless else _measured(quantity, str(quantity.units))
        raise ValueError(f"{written} is a {found}; a {_dimension(unit)} is wanted{hint}") from None
    except Exception:  # pint answers an unknown unit with many kinds of exception
        raise ValueError(f"{written} cannot be read as a {_dimension(unit)}{hint}") from None
    if math.isnan(value):
        raise ValueError(f"{written} is not a number")
    return value


def factor(unit: str, shown: str) -> float:
    """Return how many SI `unit` one `shown` unit is; both must be without offset.

    Raises:
        ValueError, pint.PintError: if `shown` is no unit, or one of something else.

    """
    return float(_read(f"1 {shown}").to(unit).magnitude)


def count(text: object, one: str) -> float:
    """Return how many of `one`, such as "0.1 °C", a quantity such as "20 °C" is.

    Raises:
        ValueError: one of them is no quantity, they are of different dimensions, or `one` is 0.

    """
    if not isinstance(text, str):
        raise ValueError(f"{brief(text)} has no unit; write it as text with a unit like {one}")
    try:
        digit, quantity = _read(one), _read(text)
        return float(quantity.to(digit.units).magnitude / digit.magnitude)
    except Exception:  # pint answers an unknown unit with many kinds of exception
        written = f'"{brief(text)}"'
        raise ValueError(f'{written} cannot be counted in "{brief(one)}"') from None


def show(value: float, unit: str, shown: str = "") -> str:
    """Return an SI value as people write it: `show(1.6e7, "Pa", "bar")` is "160 bar"."""
    target = shown or unit
    if math.isinf(value):
        return "unlimited" if value > 0.0 else "-unlimited"
    number = float(_registry().Quantity(value, unit).to(target).magnitude)
    return f"{number:.6g}" if target == "1" else f"{number:.6g} {target}"
