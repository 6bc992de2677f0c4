"""The FMU file: description, sources, and a library for each system with a compiler here."""

import re
import tempfile
import uuid
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from string import Template

from hil_emulator.ccode.compiler import LINUX, WINDOWS, CompilerError, System, build_library, host
from hil_emulator.ccode.plant_source import Exported, sources
from hil_emulator.fmi.exporting import description
from hil_emulator.fmi.exporting.variables import Variable, variables
from hil_emulator.model.equilibrium import SCALES, STEP
from hil_emulator.model.kernel import build

_HERE = Path(__file__).parent

_REFUSED = """
    EnterEventMode GetFloat32 GetInt8 GetUInt8 GetInt16 GetUInt16 GetInt32 GetUInt32 GetInt64
    GetUInt64 GetBoolean GetString GetBinary GetClock SetFloat32 SetInt8 SetUInt8 SetInt16 SetUInt16
    SetInt32 SetUInt32 SetInt64 SetUInt64 SetBoolean SetString SetBinary SetClock
    GetNumberOfVariableDependencies GetVariableDependencies EnterConfigurationMode
    ExitConfigurationMode GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction
    SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction EvaluateDiscreteStates
    UpdateDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates
    GetContinuousStateDerivatives GetEventIndicators GetContinuousStates
    GetNominalsOfContinuousStates GetNumberOfEventIndicators GetNumberOfContinuousStates
    GetOutputDerivatives ActivateModelPartition"""
"""Functions of FMI 3.0 that do not apply to this kind of FMU."""

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The date of every file in the archive, so that archives of the same content are equal."""


def contents(actuator: Exported, version: int) -> dict[str, str]:
    """Return the texts of an FMU by their names in the archive.

    Args:
        actuator: actuator to export.
        version: version of FMI, 2 or 3.

    Raises:
        TranslationError: if an effect's law cannot be translated to C.

    """
    header, body = sources(actuator)
    name = actuator.name
    exported = variables(actuator, build(actuator.effects, compiled=False))
    token = str(uuid.uuid5(uuid.NAMESPACE_URL, f"{version} {header} {body}"))
    files = (f"{name}.c", f"fmi{version}.c")
    summary = description.FmuSummary(
        name, actuator.title, token, actuator.step * actuator.steps, files
    )
    given = {"name": name, "upper": name.upper(), "token": token}
    given["input_widths"] = _widths(v for v in exported if v.causality == "input")
    given["state_widths"] = _widths(v for v in exported if v.is_state)
    given["refused"] = "\n".join(f"REFUSED(fmi3{word})" for word in _REFUSED.split())
    texts = {
        f"sources/{name}.h": header,
        f"sources/{name}.c": body,
        "sources/instance.h": _made("instance.h.in", given),
        f"sources/fmi{version}.c": _made(f"fmi{version}.c.in", given),
    }
    if version == 2:
        return {"modelDescription.xml": description.fmi2(summary, exported), **texts}
    texts["sources/buildDescription.xml"] = description.build_description(summary)
    return {"modelDescription.xml": description.fmi3(summary, exported), **texts}


def write_fmu(
    actuator: Exported, version: int, file: Path, report: Callable[[str], None], *,
    native: bool = False,
) -> None:  # fmt: skip
    """Write an FMU; systems without a compiler are left out and reported.

    Args:
        actuator: actuator to export.
        version: version of FMI, 2 or 3.
        file: output file.
        report: receives a line for each system.
        native: whether to compile for this system only; for Windows `ziglang` first makes that
            system's libraries, which takes minutes once.

    Raises:
        TranslationError: if an effect's law cannot be translated to C.
        OSError: if the file cannot be written.

    """
    texts = contents(actuator, version)
    this_system = host()
    systems = {
        s.name: s for s in ((this_system,) if native else (LINUX, WINDOWS, this_system)) if s
    }
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in texts.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), text, zipfile.ZIP_DEFLATED)
        for system in systems.values():
            folder = system.fmi2 if version == 2 else system.name
            if not folder:
                report(f"{system.name}: FMI 2.0 has no folder for it; it compiles the sources")
                continue
            try:
                binary = _library(texts, system)
            except CompilerError as error:
                report(f"{system.name}: left out: {error}")
                continue
            name = f"binaries/{folder}/{actuator.name}{system.suffix}"
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), binary, zipfile.ZIP_DEFLATED)
            report(
                system.name
                if system is this_system
                else f"{system.name}: cross-compiled, not run here"
            )


def _library(texts: Mapping[str, str], system: System) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        made: list[Path] = []
        for name, text in texts.items():
            if re.fullmatch(r"sources/.*\.[ch]", name):
                made.append(Path(folder) / Path(name).name)
                made[-1].write_text(text, encoding="utf-8")
        library = Path(folder) / f"model{system.suffix}"
        compiled: Sequence[Path] = [file for file in made if file.suffix == ".c"]
        build_library(compiled, library, system, ["-fvisibility=hidden"])
        return library.read_bytes()


def _widths(moved: Iterable[Variable]) -> str:
    """Return the step width of each variable for differences, as in the plant's linear model."""
    return ", ".join(repr(STEP * SCALES.get(v.unit, 1e-3)) for v in moved)


def _made(template: str, given: Mapping[str, str]) -> str:
    return Template((_HERE / template).read_text(encoding="utf-8")).substitute(given)
