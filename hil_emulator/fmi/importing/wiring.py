"""Assignment of an FMU's variables to the model's quantities, checked before the run."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator import input_files, units
from hil_emulator.config.plant import FmuSettings, Lead
from hil_emulator.errors import UserError, brief
from hil_emulator.fmi.importing.instance import CO_SIMULATION, MODEL_EXCHANGE
from hil_emulator.model.quantities import INPUTS, SIGNALS

_REAL = {"Real", "Float64"}


@dataclass(frozen=True)
class Wired:
    """A variable of an FMU: `value = factor * SI + offset`."""

    name: str
    reference: int
    factor: float
    offset: float


@dataclass(frozen=True)
class Wiring:
    """Checked variables of an FMU.

    Attributes:
        inputs: wired variables by name of the model's input.
        outputs: wired variables by name of the model's signal.
        parameters: value references and values, in the FMU's units.
        interface: "co-simulation" or "model exchange".

    """

    inputs: Mapping[str, Wired]
    outputs: Mapping[str, Wired]
    parameters: Mapping[int, float]
    interface: str


def wire(settings: FmuSettings) -> Wiring:
    """Read an FMU's description and find the variables of the configuration.

    Raises:
        UserError: if the file is not an FMU, is for another system or lacks the required
            interface; if a variable is missing or has another causality, type or dimension.

    """
    file = settings.file
    description = _description(file)
    variables = {v.name: v for v in description.modelVariables}
    declared = {q.name: q.unit for q in (*SIGNALS, *INPUTS)}
    inputs = {
        name: _wired(file, variables, lead, declared[name], "input")
        for name, lead in settings.inputs.items()
    }
    outputs = {
        name: _wired(file, variables, lead, declared[name], "output")
        for name, lead in settings.outputs.items()
    }
    parameters = {
        _variable(file, variables, name, "parameter").valueReference: value
        for name, value in settings.parameters.items()
    }
    return Wiring(inputs, outputs, parameters, _interface(settings, description))


def _description(file: Path) -> Any:
    try:
        import fmpy
    except ImportError:
        raise UserError(f"{file}: FMUs need FMPy: pip install 'hil-emulator[fmi]'") from None
    if not file.is_file():
        raise UserError(f"{file}: there is no such FMU")
    try:
        input_files.check_archive(file, input_files.FMU)
        description = fmpy.read_model_description(str(file))
        systems = fmpy.supported_platforms(str(file))
    except UserError:
        raise
    except Exception as error:  # a damaged archive or description raises many kinds of exception
        raise UserError(f"{file}: is no FMU: {brief(str(error))}") from None
    if description.fmiVersion[:2] not in ("2.", "3."):
        raise UserError(f"{file}: is of FMI {description.fmiVersion}; 2.0 and 3.0 can be run")
    if not {fmpy.platform, fmpy.platform_tuple} & set(systems):
        raise UserError(
            f"{file}: is for {', '.join(systems) or 'no system'}, this is {fmpy.platform}; "
            "`fmpy compile` makes a library of its sources, where it has them"
        )
    return description


def _interface(settings: FmuSettings, description: Any) -> str:
    """Return the configured interface; without one, co-simulation if available."""
    there = [
        name
        for name, present in (
            (CO_SIMULATION, description.coSimulation), (MODEL_EXCHANGE, description.modelExchange),
        )
        if present
    ]  # fmt: skip
    wanted = settings.interface
    if not there or (wanted and wanted not in there):
        named = " and ".join(there) or f"neither {CO_SIMULATION} nor {MODEL_EXCHANGE}"
        raise UserError(f"{settings.file}: has {named}" + (f", no {wanted}" if wanted else ""))
    return wanted or there[0]


def _variable(file: Path, variables: Mapping[str, Any], name: str, causality: str) -> Any:
    if name not in variables:
        near = ", ".join([v for v, one in variables.items() if one.causality == causality][:12])
        raise UserError(f"{file}: no variable '{name}'; of kind {causality} there are {near}")
    variable = variables[name]
    if variable.causality != causality and not (
        causality == "output" and variable.causality == "local"
    ):
        raise UserError(f"{file}: '{name}' is of kind {variable.causality}, wanted is {causality}")
    if variable.type not in _REAL:
        raise UserError(f"{file}: '{name}' is {variable.type}; only real numbers can be wired")
    if variable.dimensions:
        raise UserError(f"{file}: '{name}' is an array; only single numbers can be wired")
    return variable


def _plain(unit: str) -> str:
    """Return a unit of Modelica, such as "N.m/s2", in pint's form (Modelica 3.6, 19.1)."""
    return re.sub(r"(?<=[A-Za-z])(-?\d)", r"^\1", unit).replace(".", "*")


def _wired(
    file: Path, variables: Mapping[str, Any], lead: Lead, unit: str, causality: str
) -> Wired:
    variable = _variable(file, variables, lead.variable, causality)
    # a declared type may carry the unit
    declared = variable.unit or getattr(variable.declaredType, "unit", None) or ""
    there = lead.unit or _plain(declared) or unit
    if there == unit:
        return Wired(variable.name, variable.valueReference, 1.0, 0.0)
    try:
        factor, offset = units.display(unit, there)
    except Exception:  # pint raises many kinds of exception for an unknown unit
        raise UserError(
            f"{file}: '{variable.name}' is in '{brief(there)}', wanted is a unit like {unit}; "
            f'state it as "{variable.name} [{unit}]"'
        ) from None
    return Wired(variable.name, variable.valueReference, factor, offset)
