"""Schema of a scenario file, checked and in SI."""

from collections.abc import Sequence
from typing import Literal, Self

from pydantic import ConfigDict, Field, field_validator, model_validator

from hil_emulator.config.table import DescribedTable
from hil_emulator.errors import brief, did_you_mean
from hil_emulator.scenario.expect import Expect
from hil_emulator.scenario.fields import Broken, Holds, Seconds, Values
from hil_emulator.scenario.names import frame_of
from hil_emulator.signals.inputs import SET_POINTS, SETTINGS, shown

MOST_RUNS = 1000
"""Largest number of runs of a scenario (assumed)."""

Role = Literal["reference", "external", "none"]
"""Which controller acts in a scenario."""


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

    name: str = ""
    """name of the step, to which `after` of an expectation refers"""
    at: Seconds = 0.0
    """time of the action; with `when`, the condition is not examined before it"""
    when: Holds | None = None
    """condition that starts the action, such as `position > 60 mm and load_force < 100 N`"""
    set: Values = Field(default_factory=dict)
    """settings and set points, such as `{ supply_pressure = "120 bar" }`"""
    fault: Broken | None = None
    """fault to inject, as on the command line, such as `pressure_a offset value='3 bar'`"""
    nmt: Literal["start", "stop", "pre-operational", "reset", "reset communication"] | None = None
    """NMT command to every node"""
    send: list[str] = Field(default_factory=list)
    """frames to send, for example to command your controller: COB-ID and data, `["0x301 10 27"]`"""
    controller: Literal["on", "off"] | None = None
    """off: the reference controller stops sending set points; on: it sends them again"""
    profile: SignalProfile | None = None
    """a setting or set point that follows a file from now on"""

    @field_validator("send")
    @classmethod
    def _frames(cls, lines: list[str]) -> list[str]:
        for line in lines:
            frame_of(line)
        return lines

    @property
    def set_point(self) -> tuple[str, float] | None:
        """The set point that it gives to the controller, SI; None without one."""
        given = [(name, value) for name, value in self.set.items() if name in SET_POINTS]
        return given[-1] if given else None

    @property
    def words(self) -> str:
        """Description of the step, for the label of a picture."""
        targets = SETTINGS | SET_POINTS
        parts = [f"{n} {shown(targets[n], v)}" for n, v in self.set.items()]
        parts += [f"{self.fault.target} {self.fault.kind.name}"] if self.fault else []
        parts += [f"NMT {self.nmt}"] if self.nmt else []
        parts += [f"send {line}" for line in self.send]
        parts += [f"controller {self.controller}"] if self.controller else []
        parts += [f"{self.profile.signal} from {self.profile.file}"] if self.profile else []
        return ", ".join(parts)


class Scenario(DescribedTable):
    """A scenario."""

    model_config = ConfigDict(populate_by_name=True)
    title: str
    """one line for tables and reports"""
    config: list[str] = Field(min_length=1)
    """configuration files, later ones laid over earlier ones; paths relative to the scenario"""
    duration: Seconds
    """emulator time that the scenario takes"""
    controller: Role = "reference"
    """`reference`: the one of this package; `external`: yours, on the bus or in Python"""
    needs: Literal["controller"] | None = None
    """`controller`: time begins when a node has become OPERATIONAL and received a set point"""
    patience: Seconds = 30.0
    """longest time to wait for that"""
    seed: int | None = Field(None, ge=0)
    """seed of the sensors' noise; without it the one of the configuration"""
    repeat: int = Field(1, ge=1, le=MOST_RUNS)
    """number of runs, whose seeds count up from `seed`, or from 1 without it"""
    sweep: dict[str, list[str | int | float]] = Field(default_factory=dict)
    """values by a name; each text of the file that contains `{name}` is run with every value"""
    steps: list[Step] = Field(alias="step", min_length=1)
    """the actions"""
    expectations: list[Expect] = Field(alias="expect", min_length=1)
    """the expectations"""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        """Require the step of each `after`, and a controller for set points."""
        names = [step.name for step in self.steps if step.name]
        for e in self.expectations:
            if e.after and e.after not in names:
                raise ValueError(f"after: {_no_step(e.after, names)}")
        if self.controller == "none" and any(step.set_point for step in self.steps):
            raise ValueError("a step has a set point, but the scenario has no controller")
        return self


def _no_step(name: str, names: Sequence[str]) -> str:
    listed = did_you_mean(name, names) if names else "; give a step a name"
    return f"no step is named '{brief(name)}'{listed}"
