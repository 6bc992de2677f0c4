"""Quantities with units, such as "160 bar", to SI numbers and back.

    quantity   number [unit]
    unit       [["1"] "/"] term {("*" | "/" | " ") term}
    term       power or "(" power {("*" | "/" | " ") power} ")" [exponent]
    power      name [exponent]
    exponent   ("^" | "**") ["-"] digit ["." digit]

Usual units are in a table here. Of the others only what this grammar lets pass reaches pint, which
would evaluate any arithmetic: a quantity is read, never computed. Pint is loaded when the first
such unit comes: it takes longer than all the rest of a configuration.
"""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import TYPE_CHECKING

from hil_emulator.errors import brief

if TYPE_CHECKING:
    import pint

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

_WORDS_ROTARY = {"m": "angle", "m/s": "speed of rotation", "N": "torque", "kg": "inertia"}
"""What a quantity of a rotary axis may be as well, by the unit of a linear one."""

_FACTORS = {
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "mbar": 1e2, "psi": 6894.757293168361},
    "m": {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254, "ft": 0.3048},
    "m^2": {"mm^2": 1e-6, "cm^2": 1e-4, "m^2": 1.0},
    "m^3": {"ml": 1e-6, "cm^3": 1e-6, "l": 1e-3, "m^3": 1.0},
    "m^3/s": {"l/min": 1e-3 / 60.0, "cm^3/s": 1e-6, "m^3/s": 1.0, "m^3/h": 1.0 / 3600.0},
    "m/s": {"mm/s": 1e-3, "m/s": 1.0},
    "A": {"uA": 1e-6, "mA": 1e-3, "A": 1.0},
    "A/s": {"A/s": 1.0},
    "V": {"mV": 1e-3, "V": 1.0},
    "N": {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605},
    "N/m": {"N/m": 1.0, "N/mm": 1e3},
    "N*s/m": {"N*s/m": 1.0},
    "kg": {"g": 1e-3, "kg": 1.0, "t": 1e3, "lb": 0.45359237},
    "kg*m": {"kg*m": 1.0},
    "kg*m^2": {"kg*m^2": 1.0},
    "s": {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "rad": {"deg": math.pi / 180.0, "rad": 1.0},
    "rad/s": {"deg/s": math.pi / 180.0, "rad/s": 1.0},
    "N*m": {"N*m": 1.0},
    "1": {"": 1.0, "%": 1e-2},
    "m^3/(s*Pa)": {"cm^3/(min*bar)": 1e-11 / 60.0},
    "Pa*s^2/m^6": {"bar*min^2/l^2": 3.6e14},
}
"""How many of an SI unit each usual unit is (SI Brochure, tables 2 to 8; NIST SP 811 B.8)."""

ATMOSPHERE = 101_325.0
"""Pressure from which gauge pressures count [Pa] (standard atmosphere, ISO 2533)."""

ROTARY = {
    "m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2", "N": "N*m", "N*s/m": "N*m*s", "N/m": "N*m",
    "kg": "kg*m^2", "m^2": "m^3", "m/N": "rad/(N*m)", "m/s/s": "rad/s^2", "N/s": "N*m/s",
}  # fmt: skip
"""Unit of a rotary axis for that of a linear one: 1 m of the model stands for 1 rad."""

_READ_AS_ROTARY = {
    "m": "deg", "m/s": "deg/s", "m/s^2": "rad/s^2", "N": "N*m", "N*s/m": "N*m*s/rad",
    "N/m": "N*m/rad", "kg": "kg*m^2", "m^2": "cm^3/rad", "m/N": "rad/(N*m)",
    "m/s/s": "rad/s^2", "N/s": "N*m/s",
}  # fmt: skip
"""Units in which engineers read quantities of a rotary axis, by the unit of a linear one."""

_rotary: ContextVar[bool] = ContextVar("rotary", default=False)

_ANGLE = re.compile(r"rad|deg|°|turn|revolution|cycle|rpm|arcmin|arcsec")
"""Units of angles, which others of the same dimension do not stand for: Hz, %."""

_JOINED_TORQUE = re.compile(r"\bNm\b")
"""Torque as people write it; without the star it is read as another unit."""

_GAUGE = re.compile(
    r"(?P<unit>[kM]?Pa|m?bar|psi)(?:(?P<bare>[ga])|[\s_]*\(?\s*(?P<word>g|a|gauge|abs|rel)\s*\)?)"
)
"""Pressure units with a reference: barg, bar(g), bar(a), psia, kPa abs."""

_WITH_REFERENCE = re.compile(rf"{_NUMBER}((?:{_GAUGE.pattern}))\s*")

_MISTAKABLE = ("Pa", "m", "m^3/s", "A", "N", "kg", "s", "Hz")
"""Whose usual units are taken for units of something else by mistake."""


@cache
def _registry() -> "pint.UnitRegistry[float]":
    import pint

    try:
        return pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=":auto:")
    except Exception:  # a folder that cannot be written, or what another process has begun there
        return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@cache
def _words() -> dict[object, str]:
    return {_registry().Unit(unit).dimensionality: word for unit, word in _WORDS.items()}


def _measured(quantity: "pint.Quantity[float]", unit: str) -> str:
    """Return a word for what a quantity in a unit is, or else the unit."""
    return _words().get(quantity.dimensionality, f"quantity in {unit}")


@cache
def _dimension(unit: str) -> str:
    return _measured(_registry().Quantity(1.0, unit), unit)


def _wanted(unit: str) -> str:
    """Return a word for a quantity of a unit, on a rotary axis two."""
    turned = _WORDS_ROTARY.get(unit) if _rotary.get() else None
    return f"{_dimension(unit)} or {turned}" if turned else _dimension(unit)


def _parts(text: str) -> tuple[float, str]:
    """Return number and unit of a text.

    Raises:
        ValueError: if it is too long, or more than a number and a unit.

    """
    match = _QUANTITY.fullmatch(text.translate(_SUPERSCRIPTS)) if len(text) <= LONGEST else None
    if match is None:
        raise ValueError(f"write a number and a unit, at most {LONGEST} characters")
    number, unit = match.groups(default="")
    return float(number), unit


def _read(text: str) -> "pint.Quantity[float]":
    """Return the quantity that a text states.

    Raises:
        ValueError: if it is too long, or more than a number and a unit.
        pint.PintError: if there is no such unit.

    """
    number, unit = _parts(text)
    return _registry().Quantity(number, f"1{unit}" if unit.startswith("/") else unit)


def _absolute(unit: str) -> tuple[str, float]:
    """Return the unit of an absolute pressure, and what zero of the written one is [Pa]."""
    match = _GAUGE.fullmatch(unit.strip())
    if match is None:
        return unit, 0.0
    return match["unit"], ATMOSPHERE if (match["bare"] or match["word"])[0] in "gr" else 0.0


@contextmanager
def axis(*, rotary: bool) -> Iterator[None]:
    """Read quantities of a rotary axis in the block: angles along the rod, torques, inertias."""
    token = _rotary.set(rotary)
    try:
        yield
    finally:
        _rotary.reset(token)


def is_rotary() -> bool:
    """Return whether quantities are those of a rotary axis, see `axis`."""
    return _rotary.get()


def _turned(quantity: "pint.Quantity[float]", written: str, unit: str) -> float | None:
    """Return the value of a rotary quantity for a linear unit; None if it is no such quantity."""
    rotary = ROTARY.get(unit) if _rotary.get() else None
    angle = rotary in ("rad", "rad/s", "rad/s^2")
    if rotary is None or (angle and not _ANGLE.search(written)):
        return None
    return float(quantity.to(rotary).magnitude) if quantity.is_compatible_with(rotary) else None


class _OtherDimensionError(ValueError):
    """A quantity is one of something else; its text is a word for that."""


def _value(text: str, unit: str, *, difference: bool = False) -> float:
    """Return the number of `unit` in a quantity; see `to_si`.

    Raises:
        ValueError, pint.PintError: if the text is no quantity, or one of something else.

    """
    if unit == "Pa" and (above := _WITH_REFERENCE.fullmatch(text)):
        plain, atmosphere = _absolute(above[2])
        return _value(f"{above[1]} {plain}", unit) + (0.0 if difference else atmosphere)
    if _rotary.get():
        text = _JOINED_TORQUE.sub("N*m", text)
    number, written = _parts(text)
    factor = _FACTORS.get(unit, {}).get(written)
    if factor is not None:
        return number * factor
    quantity = _read(text)
    if quantity.is_compatible_with(unit):
        return float(quantity.to(unit).magnitude)
    turned = _turned(quantity, written, unit)
    if turned is not None:
        return turned
    raise _OtherDimensionError(
        "plain number" if quantity.unitless else _measured(quantity, str(quantity.units))
    )


@cache
def pattern(unit: str) -> str:
    """Return a regular expression (ECMA 262) of quantities that may be of a unit's dimension.

    It refuses numbers without a unit and common units of other dimensions; what it lets pass,
    `to_si` judges.
    """
    foreign = [other for other in _MISTAKABLE if not _alike(other, unit)]
    refused = "|".join(re.escape(word) for other in foreign for word in _FACTORS[other])
    number = r"[-+]?(\d+\.?\d*|\.\d+|inf)([eE][-+]?\d+)?"
    unit_text = rf"(?!({refused})\s*$)[%°/(A-Za-zµμΩ].*"
    return rf"^\s*{number}\s*({unit_text}){'?' if _alike(unit, '1') else ''}$"


def _alike(one: str, other: str) -> bool:
    return bool(_registry().Unit(one).dimensionality == _registry().Unit(other).dimensionality)


def to_si(text: object, unit: str, example: str = "", *, difference: bool = False) -> float:
    """Return the number of `unit` in a quantity such as "7.5 l/min".

    Args:
        text: what the user wrote; a bare number is accepted only where `unit` is "1".
        unit: SI unit of the result.
        example: a correct way to write it, for the message.
        difference: whether the quantity is a difference of two pressures, which has no reference:
            "5 bar(g)" and "5 bar" are then equal.

    Raises:
        ValueError: for anything that is not a finite or infinite number of the right dimension.

    """
    hint = f', such as "{example}"' if example else ""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise ValueError(f"{brief(text)} is not a quantity; a {_wanted(unit)} is wanted{hint}")
    if not isinstance(text, str) and unit != "1":
        raise ValueError(f"{brief(text)} has no unit; write it as text with a unit{hint}")
    written = f'"{brief(text)}"'
    try:
        value = _value(text, unit, difference=difference) if isinstance(text, str) else float(text)
    except _OtherDimensionError as found:
        raise ValueError(f"{written} is a {found}; a {_wanted(unit)} is wanted{hint}") from None
    except Exception:  # pint answers an unknown unit with many kinds of exception
        raise ValueError(f"{written} cannot be read as a {_wanted(unit)}{hint}") from None
    if math.isnan(value):
        raise ValueError(f"{written} is not a number")
    return value


def factor(unit: str, shown: str) -> float:
    """Return how many SI `unit` one `shown` unit is; both must be without offset, unlike bar(g).

    Raises:
        ValueError, pint.PintError: if `shown` is no unit, or one of something else.

    """
    plain, above = _absolute(shown)
    if above:
        raise ValueError(f"{shown} counts from the pressure of the atmosphere")
    return _value(f"1 {plain}", unit)


def scale_and_offset(unit: str, shown: str) -> tuple[float, float]:
    """Return (scale, offset): a value v of `shown` is scale v + offset of SI `unit`.

    The offset is that of gauge pressures, such as bar(g), barg and psig.

    Raises:
        ValueError, pint.PintError: if `shown` is no unit, or one of something else.

    """
    plain, above = _absolute(shown)
    return factor(unit, plain), above


_BASE = {
    "meter": "m", "kilogram": "kg", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol",
    "candela": "cd", "radian": "rad",
}  # fmt: skip


def base_exponents(unit: str) -> dict[str, float]:
    """Return the powers of SI base units that an SI unit is made of: {"m": 1, "s": -1} of "m/s"."""
    base = _registry().Quantity(1.0, unit).to_base_units()
    return {_BASE[str(name)]: float(str(power)) for name, power in base.unit_items()}


def display(unit: str, shown: str) -> tuple[float, float]:
    """Return (factor, offset): a value v of SI `unit` is factor v + offset of `shown`."""
    at_zero, at_one = (float(_registry().Quantity(v, unit).to(shown).magnitude) for v in (0.0, 1.0))
    return at_one - at_zero, at_zero


def multiple(text: object, unit: str) -> tuple[float, float]:
    """Return (factor, offset): n digits of `text` are factor n + offset of SI `unit`.

    Args:
        text: what one digit is, such as "0.1 mbar", "bar" or "0.1 bar(g)"; the offset is that of
            gauge pressures.
        unit: SI unit of the result.

    Raises:
        ValueError: it is no quantity of this dimension, or 0.

    """
    written = _with_number(text)
    above = _WITH_REFERENCE.fullmatch(written) if isinstance(written, str) else None
    offset = _absolute(above[2])[1] if above and unit == "Pa" else 0.0
    factor = to_si(written, unit, f"1 {unit}") - offset
    if not factor or math.isinf(factor):
        raise ValueError("unit is what one digit stands for: a finite quantity, not 0")
    return factor, offset


def _with_number(text: object) -> object:
    """Return a unit alone, such as "bar", as one of it; anything else as it is."""
    if isinstance(text, str) and text.strip() and not re.match(_NUMBER, text):
        return f"1 {text.strip()}"
    return text


def count(text: object, one: str) -> float:
    """Return how many of `one`, such as "0.1 °C" or "bar", a quantity such as "20 °C" is.

    Raises:
        ValueError: one of them is no quantity, they are of different dimensions, or `one` is 0.

    """
    if not isinstance(text, str):
        raise ValueError(f"{brief(text)} has no unit; write it as text with a unit like {one}")
    try:
        whole = str(_with_number(one))
        (number, unit), (size, digit_unit) = _parts(text), _parts(whole)
        for factors in _FACTORS.values():
            if unit and unit in factors and digit_unit in factors:
                return number * factors[unit] / (size * factors[digit_unit])
        digit, quantity = _read(whole), _read(text)
        return float(quantity.to(digit.units).magnitude / digit.magnitude)
    except Exception:  # pint answers an unknown unit with many kinds of exception
        written = f'"{brief(text)}"'
        raise ValueError(f'{written} cannot be counted in "{brief(one)}"') from None


_READ_AS = {"Pa": "bar", "m": "mm", "A": "mA", "m/s": "mm/s"}
"""Units in which engineers read signals, by their SI unit."""


def read_as(unit: str, linear: str = "") -> str:
    """Return the unit in which engineers read a signal, or another quantity along the axis.

    Args:
        unit: SI unit of the linear axis.
        linear: the unit for a linear axis, where it is another one than that of signals.

    """
    of_rotary = _READ_AS_ROTARY.get(unit) if _rotary.get() else None
    return of_rotary or linear or _READ_AS.get(unit, unit)


def show(value: float, unit: str, shown: str = "") -> str:
    """Return an SI value as people write it: `show(1.6e7, "Pa", "bar")` is "160 bar"."""
    target = shown or unit
    if target == _READ_AS_ROTARY.get(unit):
        unit = ROTARY[unit]
    if math.isinf(value):
        return "unlimited" if value > 0.0 else "-unlimited"
    factor = 1.0 if target == unit else _FACTORS.get(unit, {}).get(target)
    if factor is not None:
        number = value / factor
    else:
        number = float(_registry().Quantity(value, unit).to(target).magnitude)
    return f"{number:.6g}" if target == "1" else f"{number:.6g} {target}"
