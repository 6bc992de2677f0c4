"""`[plant]`: an FMU that replaces the built-in plant."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from hil_emulator.config.table import DescribedTable, QuantityReader
from hil_emulator.errors import UserError
from hil_emulator.model.declare import Param
from hil_emulator.model.quantities import INPUTS, SIGNALS

_TIMEOUT = Param(
    "timeout", "s", "time after which a step of an FMU counts as hung", 1.0, 1e-3, 3600.0
)


class PlantTable(DescribedTable):
    """An FMU that replaces the built-in plant."""

    fmu: str | None = None
    """functional mock-up unit, FMI 2.0 or 3.0; the path is relative to this file"""
    interface: Literal["co-simulation", "model exchange"] | None = None
    """who integrates an FMU that has both: its own solver, or the emulator"""
    inputs: dict[str, str] = Field(default_factory=dict)
    """the FMU's variable for each input, such as `valve_current = "u [mA]"`, with its unit there"""
    outputs: dict[str, str] = Field(default_factory=dict)
    """the FMU's variable for each signal that sensors measure: `position = "cylinder.s"`"""
    parameters: dict[str, float] = Field(default_factory=dict)
    """values of the FMU's parameters, by their names and in their units there"""
    timeout: Annotated[float, QuantityReader(_TIMEOUT)] = 1.0


@dataclass(frozen=True)
class Lead:
    """A variable of an FMU, and its unit in the configuration; "" for its own."""

    variable: str
    unit: str


@dataclass(frozen=True)
class FmuSettings:
    """An FMU that replaces the built-in plant."""

    file: Path
    inputs: Mapping[str, Lead]
    outputs: Mapping[str, Lead]
    parameters: Mapping[str, float]
    timeout: float
    interface: str | None = None


def fmu_settings(table: PlantTable, file: Path) -> FmuSettings | None:
    """Return the FMU of a configuration; None for the built-in plant.

    Args:
        table: as it was read.
        file: the configuration that names the FMU.

    Raises:
        UserError: if a signal is unknown, or variables are mapped without an FMU.

    """
    if table.fmu is None:
        if table.inputs or table.outputs or table.parameters:
            raise UserError(
                f'{file}: [plant] wires an FMU without naming it: add fmu = "crane.fmu"'
            )
        return None
    for kind, given, names_known in (
        ("inputs", table.inputs, INPUTS), ("outputs", table.outputs, SIGNALS),
    ):  # fmt: skip
        names = [q.name for q in names_known]
        for name in given:
            if name not in names:
                raise UserError(
                    f"{file}: [plant.{kind}] {name}: unknown; there are {', '.join(names)}"
                )
    return FmuSettings(
        file.parent / table.fmu, _leads(table.inputs), _leads(table.outputs), table.parameters,
        table.timeout, table.interface,
    )  # fmt: skip


def _leads(given: Mapping[str, str]) -> dict[str, Lead]:
    """Split "cylinder.s [mm]" into name and unit; an array element's bracket has no space."""
    wired = {}
    for name, text in given.items():
        match = re.fullmatch(r"(.*?)(?:\s+\[(.+)\])?", text.strip())
        assert match is not None
        wired[name] = Lead(match[1], match[2] or "")
    return wired
