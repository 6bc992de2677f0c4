"""`modelDescription.xml` of FMI 2.0 and 3.0."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from hil_emulator import __version__, units
from hil_emulator.fmi.exporting.variables import Variable

Element = ElementTree.Element
_child = ElementTree.SubElement


@dataclass(frozen=True)
class FmuSummary:
    """General data of an FMU.

    Attributes:
        name: identifier of the model.
        description: one line of text.
        token: unique identifier of the FMU.
        period: period of a tick [s].
        sources: names of the files to compile.

    """

    name: str
    description: str
    token: str
    period: float
    sources: Sequence[str]


def fmi2(fmu: FmuSummary, variables: Sequence[Variable]) -> str:
    """Return the description for FMI 2.0."""
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=fmu.name, guid=fmu.token,
        description=fmu.description, generationTool=_tool(),
        variableNamingConvention="structured",
    )  # fmt: skip
    simulation = _child(
        root, "CoSimulation", modelIdentifier=fmu.name, canGetAndSetFMUstate="true",
        canHandleVariableCommunicationStepSize="true", canSerializeFMUstate="true",
        canNotUseMemoryManagementFunctions="true", providesDirectionalDerivative="true",
    )  # fmt: skip
    files = _child(simulation, "SourceFiles")
    for name in fmu.sources:
        _child(files, "File", name=name)
    _units(root, variables)
    _child(_child(root, "LogCategories"), "Category", name="logStatusError")
    _child(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize=repr(fmu.period))
    model = _child(root, "ModelVariables")
    for v in variables:
        scalar = _child(
            model, "ScalarVariable", _initial(v), name=v.name, valueReference=str(v.reference),
            description=v.description, causality=v.causality, variability=v.variability,
        )  # fmt: skip
        rate = {} if v.rate_of is None else {"derivative": str(v.rate_of + 1)}
        _child(scalar, "Real", _numbers(v) | rate)
    structure = _child(root, "ModelStructure")
    # a variable's index is its place here, counted from one
    for part, unknowns in _unknowns(variables, 1).items():
        listed = _child(structure, f"{part}s")
        for index, given in unknowns:
            _child(listed, "Unknown", {"index": index} | given)
    return _text(root)


def fmi3(fmu: FmuSummary, variables: Sequence[Variable]) -> str:
    """Return the description for FMI 3.0."""
    root = Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=fmu.name,
        instantiationToken=fmu.token, description=fmu.description, generationTool=_tool(),
        variableNamingConvention="structured",
    )  # fmt: skip
    _child(
        root, "CoSimulation", modelIdentifier=fmu.name, canGetAndSetFMUState="true",
        canHandleVariableCommunicationStepSize="true", canSerializeFMUState="true",
        providesDirectionalDerivatives="true", providesAdjointDerivatives="true",
        fixedInternalStepSize=repr(fmu.period),
    )  # fmt: skip
    _units(root, variables)
    _child(_child(root, "LogCategories"), "Category", name="logStatusError")
    _child(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize=repr(fmu.period))
    model = _child(root, "ModelVariables")
    for v in variables:
        rate = {} if v.rate_of is None else {"derivative": str(v.rate_of)}
        _child(
            model, "Float64", _numbers(v) | _initial(v) | rate, name=v.name,
            valueReference=str(v.reference), description=v.description, causality=v.causality,
            variability=v.variability,
        )  # fmt: skip
    _child(
        model, "Float64", name="time", valueReference=str(len(variables)), unit="s",
        causality="independent", variability="continuous", description="time",
    )  # fmt: skip
    structure = _child(root, "ModelStructure")
    names = {"Derivative": "ContinuousStateDerivative"}
    for part, unknowns in _unknowns(variables, 0).items():
        for reference, given in unknowns:
            _child(structure, names.get(part, part), {"valueReference": reference} | given)
    return _text(root)


def _unknowns(
    variables: Sequence[Variable], first: int
) -> dict[str, list[tuple[str, dict[str, str]]]]:
    """Return the model's structure: the computed variables and their dependencies.

    At a communication point outputs are those of the last step: they do not depend on the present
    inputs, and readings do not depend on a state. Without an attribute, a variable depends on all.
    """
    states = " ".join(str(v.reference + first) for v in variables if v.is_state)
    unknowns: dict[str, list[tuple[str, dict[str, str]]]] = {
        "Output": [], "Derivative": [], "InitialUnknown": [],
    }  # fmt: skip
    for v in variables:
        place = str(v.reference + first)
        if v.causality == "output":
            unknowns["Output"].append((place, {"dependencies": states if v.follows_states else ""}))
        if v.rate_of is not None:
            unknowns["Derivative"].append((place, {}))
        if v.causality in ("output", "local"):
            unknowns["InitialUnknown"].append((place, {}))
    return unknowns


def build_description(fmu: FmuSummary) -> str:
    """Return `sources/buildDescription.xml` of FMI 3.0."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = _child(root, "BuildConfiguration", modelIdentifier=fmu.name)
    files = _child(configuration, "SourceFileSet", language="C99")
    for name in fmu.sources:
        _child(files, "SourceFile", name=name)
    return _text(root)


def _tool() -> str:
    return f"hil-emulator {__version__}"


def _initial(v: Variable) -> dict[str, str]:
    if v.causality in ("output", "local"):
        return {"initial": "calculated"}
    return {"initial": "exact"} if v.causality == "parameter" else {}


def _numbers(v: Variable) -> dict[str, str]:
    """Return unit, bounds and start value of a variable as attributes."""
    attributes = {} if v.unit in ("", "1") else {"unit": v.unit}
    if attributes and v.shown != v.unit:
        attributes["displayUnit"] = v.shown
    attributes |= {
        word: repr(bound)
        for word, bound in (("min", v.low), ("max", v.high))
        if math.isfinite(bound)
    }
    return attributes if v.start is None else attributes | {"start": _number(v.start)}


def _number(value: float) -> str:
    """Return a number in the form of XML Schema."""
    return repr(value) if math.isfinite(value) else repr(value).upper()


def _units(root: Element, variables: Iterable[Variable]) -> None:
    definitions = _child(root, "UnitDefinitions")
    shown: dict[str, set[str]] = {"s": set()}
    for v in variables:
        if v.unit not in ("", "1"):
            shown.setdefault(v.unit, set()).update({v.shown} - {v.unit})
    for name, others in sorted(shown.items()):
        unit = _child(definitions, "Unit", name=name)
        exponents = units.base_exponents(name)
        if all(n == round(n) for n in exponents.values()):
            _child(unit, "BaseUnit", {n: str(round(power)) for n, power in exponents.items()})
        for other in sorted(others):
            factor, offset = units.display(name, other)
            _child(unit, "DisplayUnit", name=other, factor=repr(factor), offset=repr(offset))


def _text(root: Element) -> str:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
