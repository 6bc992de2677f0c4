"""What a scenario file says, checked and in SI."""

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
from hil_emulator.config.table import StrictTable
from hil_emulator.config.toml_file import read_toml
from hil_emulator.errors import UserError, brief
from hil_emulator.faults.fault import Fault, spoken
from hil_emulator.signals import condition
from hil_emulator.signals.condition import Condition
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS, setting
from hil_emulator.units import show, to_si

LONGEST_S = 1e6
"""The longest time of a scenario [s]: twelve days (assumed)."""

NMT = {"start": 1, "stop": 2, "pre-operational": 128, "reset": 129, "reset communication": 130}
"""NMT commands (CiA 301 7.2.8.2.1)."""


def _time(text: object) -> float:
    seconds = to_si(text, "s", "200 ms")
    if not 0.0 <= seconds <= LONGEST_S:
        raise ValueError(f'"{brief(text)}" is not a time after the start, at most {LONGEST_S:g} s')
    return seconds


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
    known = SETTINGS | SET_POINTS
    if not isinstance(given, dict) or not given.keys() <= known.keys():
        raise ValueError(f"set knows {', '.join(known)}")
    try:
        return {name: setting(name, value, known) for name, value in given.items()}
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


Seconds = Annotated[float, BeforeValidator(_time)]
Broken = Annotated[Fault, BeforeValidator(_broken)]
Holds = Annotated[Condition, BeforeValidator(_condition)]
Values = Annotated[dict[str, float], BeforeValidator(_values)]


class SignalProfile(StrictTable):
    """A setting or a set point over time, from a CSV file: a header, then time [s], value (SI)."""

    signal: Literal[
        "supply_pressure", "lines_closed", "external_force", "wall_shift", "position", "load_force",
        "valve_current",
    ]  # fmt: skip
    file: str


class Step(StrictTable):
    """Something done at a time, or when a condition first holds.

    Attributes:
        at: emulator time [s].
        when: the condition; with `at`, not before that.
        set: set points and settings.
        fault: what breaks, as at the command line.
        nmt: an NMT command to every node.
        controller: "off" sends no more set points, "on" sends them again.
        profile: a setting or set point that follows a file from now on.

    """

    at: Seconds = 0.0
    when: Holds | None = None
    set: Values = Field(default_factory=dict)
    fault: Broken | None = None
    nmt: Literal["start", "stop", "pre-operational", "reset", "reset communication"] | None = None
    controller: Literal["on", "off"] | None = None
    profile: SignalProfile | None = None

    @property
    def words(self) -> str:
        """What is done, for the label of a picture."""
        known = SETTINGS | SET_POINTS
        said = [f"{n} {show(v, known[n].unit, known[n].shown)}" for n, v in self.set.items()]
        said += [f"{self.fault.target} {self.fault.kind.name}"] if self.fault else []
        said += [f"NMT {self.nmt}"] if self.nmt else []
        said += [f"controller {self.controller}"] if self.controller else []
        said += [f"{self.profile.signal} from {self.profile.file}"] if self.profile else []
        return ", ".join(said)


class Expect(StrictTable):
    """What is expected of a signal or of the frames.

    Attributes:
        signal: a column of a recording.
        within: lowest and highest value, as quantities.
        start: from when on the signal has to be there [s]; written `from`.
        until: to when [s]; the end without one.
        by: by when at the latest it has to be there [s].
        lasting: how long it has to stay from then [s]; written `for`; to the end without one.
        frame: COB-ID such as 0x085 that is looked for from `from` to `until`.
        data: how its data have to begin, in hexadecimal.
        seen: whether it has to be seen, or not.

    """

    model_config = ConfigDict(populate_by_name=True)
    signal: str | None = None
    within: tuple[float, float] | None = None
    start: Seconds = Field(0.0, alias="from")
    until: Seconds | None = None
    by: Seconds | None = None
    lasting: Seconds | None = Field(None, alias="for")
    frame: int | None = Field(None, ge=0, le=0x1FFF_FFFF)
    data: str = ""
    seen: bool = True

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


class Scenario(StrictTable):
    """A scenario.

    Attributes:
        title: one line for tables.
        config: configuration files, beside the scenario.
        duration: how long it takes [s].
        seed: another seed of the sensor noise.
        steps: what happens; written `[[step]]`.
        expectations: what has to be true; written `[[expect]]`.

    """

    model_config = ConfigDict(populate_by_name=True)
    title: str
    config: list[str] = Field(min_length=1)
    duration: Seconds
    seed: int | None = Field(None, ge=0)
    steps: list[Step] = Field(alias="step", min_length=1)
    expectations: list[Expect] = Field(alias="expect", min_length=1)


_TABLES: dict[str, type[StrictTable]] = {"step": Step, "expect": Expect, "profile": SignalProfile}


def _told(place: Sequence[int | str], kind: str) -> str:
    """Return what is wrong with a key, "" where pydantic's own words do."""
    if kind == "missing":
        return "is missing"
    if kind != "extra_forbidden":
        return ""
    tables = [_TABLES[part] for part in map(str, place[:-1]) if part in _TABLES]
    fields = (tables[-1] if tables else Scenario).model_fields
    known = [field.alias or name for name, field in fields.items()]
    close = difflib.get_close_matches(str(place[-1]), known, 1)
    meant = f", did you mean {close[0]}" if close else ""
    return f"no such key{meant}; there are {', '.join(known)}"


def load(file: Path) -> Scenario:
    """Read and check a scenario.

    Raises:
        UserError: with every mistake found, each with its place.

    """
    try:
        return Scenario.model_validate(read_toml(file, "scenario"))
    except ValidationError as error:
        mistakes = error.errors()
        lines = [
            f"{file}: {'.'.join(str(part) for part in e['loc'])}: "
            f"{_told(e['loc'], e['type']) or e['msg'].removeprefix('Value error, ')}"
            for e in mistakes[:SHOWN]
        ]
        lines += [f"{file}: and {len(mistakes) - SHOWN} more"] if len(mistakes) > SHOWN else []
        raise UserError("\n".join(lines)) from None
