"""`[[node]] map`: what objects of a node show and command, without a change to its EDS.

map = {
"0x6130:1" = "pressure_a",                                    # channel or command
"0x2090:1" = { channel = "pressure_b", unit = "0.1 mbar" },   # one digit
"0x6401:1" = { channel = "pressure_a", points = { "4 mA" = "0 bar", "20 mA" = "250 bar" },
               digits = "1 uA", range = ["0 mA", "24 mA"] },
"0x6411:1" = { command = "valve_current", points = { "-10 V" = "-1 A", "10 V" = "1 A" },
               digits = "1 mV" },
"0x6200:1" = { command = "valve_enable", bit = 0 },
"0x6077:0" = 0,                                               # digits
"0x2100"   = { ramp = [0, 500], time = "2 s" },               # digits, and then held
"0x2103"   = { constant = "20 °C", unit = "0.1 °C" },         # 200 digits; a course likewise
"0x2101"   = { table = [["0 s", 20], ["5 s", 60]], repeat = true },
"0x2102"   = { file = "oil.csv", column = "temperature" },    # first column: time in s
}
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from hil_emulator.config.course_points import Points, points
from hil_emulator.config.scale import SCALES, Ends, read_scale
from hil_emulator.errors import did_you_mean
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.units import count

COMMAND_UNITS = {"valve_current": "A"}
"""Commands of a node, with their SI units."""
AMPLIFIER_UNITS = {"valve_enable": "1", "valve_ramp_time": "s"}
"""Commands to the valve amplifier of a node, with their SI units; see `device.profiles.amplifier`.
"""
COMMANDS = (*COMMAND_UNITS, *AMPLIFIER_UNITS)
"""All commands of a node."""
LONGEST_WORD = 32
"""Bits of a word in which one may enable."""
DEVICE_SIGNALS = ("sample_counter", "sample_time")
"""Signals that the node itself provides."""

_PLACE = re.compile(r"0[xX]([0-9A-Fa-f]{4})(?::([0-9A-Fa-f]{1,2}))?")
UNITS = {c.name: c.unit for c in CHANNELS} | COMMAND_UNITS | AMPLIFIER_UNITS
"""SI unit of each channel and command."""
KEYS = {
    "channel": SCALES,
    "command": (*SCALES, "bit"),
    "constant": ("unit",),
    "ramp": ("time", "repeat", "unit"),
    "table": ("repeat", "unit"),
    "file": ("column", "repeat"),
}
"""By the key of an object's source, the keys that may accompany it."""

MEANINGS = {
    "channel": "sensor channel, `sample_counter` or `sample_time` that the object shows",
    "command": "`valve_current`, or `valve_enable` and `valve_ramp_time` of the valve's amplifier",
    "constant": "value that the object keeps: digits, text, or a quantity if there is a unit",
    "ramp": "first and last value of a ramp, in digits or as quantities if there is a unit",
    "table": 'times and values of a course: `[["0 s", 20], ["5 s", 60]]`',
    "file": "CSV file, times [s] in its first column; the path is relative to the configuration",
    "unit": 'what one digit is, such as `"0.1 mbar"` or `"bar"`; without it Unit and Factor of the '
    "EDS",
    "points": 'two points of a scale: `{ "4 mA" = "0 bar", "20 mA" = "250 bar" }`; those of a '
    "command are its limits",
    "digits": 'what one digit is of what the points are measured in, such as `"1 uA"`; without it '
    "the points are in digits",
    "range": 'where the device saturates: `["0 mA", "24 mA"]`, in digits without `digits`; without '
    "it at the ends of the data type",
    "bit": "number of the bit that enables, from 0; without it any value but 0 enables",
    "time": 'duration of the ramp, such as `"2 s"`',
    "repeat": "whether ramp, table or file begins again at its end",
    "column": "column of the file; without it the second one",
}
"""Meaning of the keys of an object that is written as a table."""


@dataclass(frozen=True)
class ObjectSettings:
    """Source or command of one object.

    Attributes:
        index: 16-bit index.
        subindex: 8-bit sub-index.
        signal: channel or command, "" for neither.
        unit: SI unit of `factor`; of a constant the unit of a digit, "" for digits.
        factor: value of one digit; None leaves it to the EDS.
        offset: value of 0 digits.
        ends: digits at which the device saturates; None for those of the data type.
        bit: the only bit that counts; None for all.
        constant: its value; None without.
        points: corners of its course over time, empty without one.
        repeat: whether the course is repeated.
        column: place of the course in a CSV file: file and name of the column.

    """

    index: int
    subindex: int
    signal: str = ""
    unit: str = ""
    factor: float | None = None
    offset: float = 0.0
    ends: Ends | None = None
    bit: int | None = None
    constant: float | str | None = None
    points: Points = ()
    repeat: bool = False
    column: tuple[str, str] | None = None

    @property
    def where(self) -> str:
        """Notation of index and sub-index."""
        return f"0x{self.index:04X}:{self.subindex:02X}"


def read_map(content: object) -> tuple[ObjectSettings, ...]:
    """Return the settings of a table.

    Raises:
        ValueError: names the object and the mistake.

    """
    if not isinstance(content, Mapping):
        raise ValueError('is a table of objects, such as { "0x6130:1" = "pressure_a" }')
    mapped, mistakes = [], []
    for key, value in content.items():
        try:
            mapped.append(_object(str(key), value))
        except ValueError as error:
            mistakes.append(str(error))
    if mistakes:
        raise ValueError("\n    ".join(mistakes))
    places = [settings.where for settings in mapped]
    signals = [settings.signal for settings in mapped]
    for settings in mapped:
        if places.count(settings.where) > 1:
            raise ValueError(f"{settings.where} stands there twice")
        if settings.signal in COMMANDS and signals.count(settings.signal) > 1:
            raise ValueError(f"two objects give the command {settings.signal}; keep one")
    return tuple(mapped)


def _object(key: str, content: object) -> ObjectSettings:
    place = _PLACE.fullmatch(key)
    if place is None:
        raise ValueError(f'{key!r} is not an object; write it as "0x6130:1", in hexadecimal')
    index, subindex = int(place[1], 16), int(place[2] or "0", 16)
    try:
        return ObjectSettings(index, subindex, **read_value(content))
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None


def read_value(content: object) -> dict[str, Any]:
    """Return the fields of `ObjectSettings` for a value.

    Raises:
        ValueError: it is no channel, command, constant or course.

    """
    if isinstance(content, str):
        return _signal(content, {})
    if isinstance(content, int | float):
        return _constant(content)
    if not isinstance(content, Mapping):
        raise ValueError(f"{content!r} is no name, number or table")
    kinds = [kind for kind in KEYS if kind in content]
    if len(kinds) != 1:
        raise ValueError(
            f"give one of {', '.join(KEYS)}; found {', '.join(kinds) or 'no such key'}"
        )
    (kind,) = kinds
    wrong = [key for key in content if key != kind and key not in KEYS[kind]]
    if wrong:
        keys = ", ".join(KEYS[kind]) or "nothing"
        raise ValueError(f"unknown key '{wrong[0]}'; an entry with {kind} takes {keys}")
    return _of_kind(kind, content)


def _of_kind(kind: str, table: Mapping[str, Any]) -> dict[str, Any]:
    content = table[kind]
    repeat = bool(table.get("repeat", False))
    if kind in ("channel", "command"):
        return _signal(str(content), table)
    if kind == "constant":
        unit = table.get("unit")
        return _constant(_digits(content, unit)) | {"unit": str(unit or "")}
    if kind == "file":
        return {"column": (str(content), str(table.get("column", ""))), "repeat": repeat}
    if kind == "ramp":
        if not isinstance(content, list) or len(content) != 2:
            raise ValueError("a ramp goes from one value to another: ramp = [0, 500]")
        content = [["0 s", content[0]], [table.get("time", ""), content[1]]]
    if isinstance(content, list):
        content = [[*row[:-1], _digits(row[-1], table.get("unit"))] for row in map(_row, content)]
    return {"points": points(content), "repeat": repeat}


def _row(row: object) -> list[Any]:
    """Return a row of a table; a wrong row is returned too, and refused with the others."""
    return row if isinstance(row, list) and row else [row]


def _digits(content: Any, unit: object) -> Any:
    """Return a value in digits; a quantity is divided by `unit`."""
    return content if unit is None else count(content, str(unit))


def _constant(content: object) -> dict[str, Any]:
    if isinstance(content, str) or (isinstance(content, int | float) and isfinite(content)):
        return {"constant": content}
    raise ValueError(f"constant {content!r} is no number or text")


def _signal(name: str, table: Mapping[str, Any]) -> dict[str, Any]:
    if name not in UNITS and name not in DEVICE_SIGNALS:
        hint = did_you_mean(name, (*UNITS, *DEVICE_SIGNALS))
        raise ValueError(f"no channel or command {name!r}{hint}")
    if name in DEVICE_SIGNALS:
        return {"signal": name}
    settings = {"signal": name, **read_scale(table, UNITS[name], command=name in COMMANDS)}
    if "bit" in table:
        bit = table["bit"]
        if name != "valve_enable" or not isinstance(bit, int) or not 0 <= bit < LONGEST_WORD:
            raise ValueError("bit is the number of a bit of valve_enable, 0 to 31")
        settings["bit"] = bit
    return settings
