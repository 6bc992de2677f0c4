"""Schema of a scenario file, checked and in SI."""

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from hil_emulator.config.mistakes import SHOWN
from hil_emulator.config.table import DescribedTable, QuantityReader
from hil_emulator.config.toml_file import read_toml
from hil_emulator.errors import UserError
from hil_emulator.faults.fault import Fault, spoken
from hil_emulator.model.declare import Param
from hil_emulator.signals import condition
from hil_emulator.signals.condition import Condition
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS, setting
from hil_emulator.units import show, to_si

LONGEST_S = 1e6
"""The longest time of a scenario [s]: twelve days (assumed)."""

NMT = {"start": 1, "stop": 2, "pre-operational": 128, "reset": 129, "reset communication": 130}
"""NMT commands (CiA 301 7.2.8.2.1)."""


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
    if not isinstance(given, dict) or not given.keys() <= targets.keys():
        raise ValueError(f"unknown key in set; there are {', '.join(targets)}")
    try:
        return {name: setting(name, value, targets) for name, value in given.items()}
    except UserError as error:
        raise ValueError(str(error)) from None


def _band(signal: object, within: object) -> tuple[float, ...]:
    """Return the bounds of a signal in SI; zero needs no unit."""
    try:
        unit = condition.unit_of(str(signal))
    except UserError as error:
        raise ValueError(str(error)) from None
    if not isinstance(within, list) or len(within) != 2:
        raise ValueError("within is a list of the lowest and the highest value")
    return tuple(0.0 if bound == 0 else to_si(bound, unit) for bound in within)


TIME = Param("time", "s", "time after the start", 0.2, 0.0, LONGEST_S)
Seconds = Annotated[float, QuantityReader(TIME)]
OptionalSeconds = Annotated[float | None, QuantityReader(TIME)]
Broken = Annotated[Fault, BeforeValidator(_broken)]
Holds = Annotated[Condition, BeforeValidator(_condition)]
Values = Annotated[dict[str, float], BeforeValidator(_values)]


class SignalProfile(DescribedTable):
    """A setting or a set point over time, from a CSV file: a header, then time [s], value (SI)."""

    signal: Literal[
        "supply_pressure", "lines_closed", "external_force", "wall_shift", "position", "load_force",
        "valve_current",
    ]  # fmt: skip
    """the setting or set point that follows the file"""
    file: str
    """CSV file; the path is relative to the scenario"""


class Step(DescribedTable):
    """An action at a time, or when a condition first holds."""

    at: Seconds = 0.0
    """emulator time of the action; with `when`, the condition is not examined before it"""
    when: Holds | None = None
    """condition that starts the action, such as `position > 60 mm and load_force < 100 N`"""
    set: Values = Field(default_factory=dict)
    """settings and set points, such as `{ supply_pressure = "120 bar" }`"""
    fault: Broken | None = None
    """fault to inject, as on the command line, such as `pressure_a offset value='3 bar'`"""
    nmt: Literal["start", "stop", "pre-operational", "reset", "reset communication"] | None = None
    """NMT command to every node"""
    controller: Literal["on", "off"] | None = None
    """off: the controller stops sending set points; on: it sends them again"""
    profile: SignalProfile | None = None
    """a setting or set point that follows a file from now on"""

    @property
    def words(self) -> str:
        """Description of the step, for the label of a picture."""
        targets = SETTINGS | SET_POINTS
        parts = [f"{n} {show(v, targets[n].unit, targets[n].shown)}" for n, v in self.set.items()]
        parts += [f"{self.fault.target} {self.fault.kind.name}"] if self.fault else []
        parts += [f"NMT {self.nmt}"] if self.nmt else []
        parts += [f"controller {self.controller}"] if self.controller else []
        parts += [f"{self.profile.signal} from {self.profile.file}"] if self.profile else []
        return ", ".join(parts)


class Expect(DescribedTable):
    """An expectation of a signal or of the frames on the bus."""

    model_config = ConfigDict(populate_by_name=True)
    signal: str | None = None
    """a column of a recording, such as `position` or `model.velocity`"""
    within: tuple[float, float] | None = None
    """lowest and highest value of the signal, as quantities, such as `["59 mm", "61 mm"]`"""
    start: Seconds = Field(0.0, alias="from")
    """time from which on the signal has to be within the limits, or the frame is looked for"""
    until: OptionalSeconds = None
    """time until which it has to be within the limits, or the frame is looked for; else the end"""
    by: OptionalSeconds = None
    """latest time at which the signal has to enter the limits"""
    lasting: OptionalSeconds = Field(None, alias="for")
    """how long it has to stay within the limits after that; without it to the end"""
    frame: int | None = Field(None, ge=0, le=0x1FFF_FFFF)
    """COB-ID of a frame, such as `"0x085"`; or the number"""
    data: str = ""
    """beginning of the frame's data, in hexadecimal"""
    seen: bool = True
    """whether the frame has to be seen; false: it must not be seen"""

    @model_validator(mode="before")
    @classmethod
    def _in_si(cls, given: Any) -> Any:
        """Read the band in the signal's unit, a frame in hexadecimal."""
        if not isinstance(given, dict) or ("signal" in given) == ("frame" in given):
            raise ValueError("name either a signal or a frame")
        given = dict(given)
        if isinstance(given.get("frame"), str):
            given["frame"] = int(given["frame"], 16)
        if "signal" in given:
            given["within"] = _band(given["signal"], given.get("within"))
        return given

    @field_validator("data")
    @classmethod
    def _hexadecimal(cls, text: str) -> str:
        bytes.fromhex(text)
        return text


class Scenario(DescribedTable):
    """A scenario."""

    model_config = ConfigDict(populate_by_name=True)
    title: str
    """one line for tables and reports"""
    config: list[str] = Field(min_length=1)
    """configuration files, later ones laid over earlier ones; paths relative to the scenario"""
    duration: Seconds
    """emulator time that the scenario takes"""
    seed: int | None = Field(None, ge=0)
    """seed of the sensors' noise; without it the one of the configuration"""
    steps: list[Step] = Field(alias="step", min_length=1)
    """the actions"""
    expectations: list[Expect] = Field(alias="expect", min_length=1)
    """the expectations"""


_TABLES: dict[str, type[DescribedTable]] = {
    "step": Step,
    "expect": Expect,
    "profile": SignalProfile,
}


def _mistake(place: Sequence[int | str], kind: str) -> str:
    """Return the message for an unknown key; "" for other mistakes, which pydantic describes."""
    if kind == "missing":
        return "is missing"
    if kind != "extra_forbidden":
        return ""
    tables = [_TABLES[part] for part in map(str, place[:-1]) if part in _TABLES]
    fields = (tables[-1] if tables else Scenario).model_fields
    keys = [field.alias or name for name, field in fields.items()]
    close = difflib.get_close_matches(str(place[-1]), keys, 1)
    meant = f", did you mean {close[0]}" if close else ""
    return f"no such key{meant}; there are {', '.join(keys)}"


def load(file: Path) -> Scenario:
    """Read and check a scenario.

    Raises:
        UserError: with the place of every mistake.

    """
    try:
        return Scenario.model_validate(read_toml(file, "scenario"))
    except ValidationError as error:
        mistakes = error.errors()
        lines = [
            f"{file}: {'.'.join(str(part) for part in e['loc'])}: "
            f"{_mistake(e['loc'], e['type']) or e['msg'].removeprefix('Value error, ')}"
            for e in mistakes[:SHOWN]
        ]
        lines += [f"{file}: and {len(mistakes) - SHOWN} more"] if len(mistakes) > SHOWN else []
        raise UserError("\n".join(lines)) from None
