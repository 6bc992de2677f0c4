"""The FMUs for model exchange that the tests compile: `slide.c` and its descriptions."""

import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

from hil_emulator.ccode.compiler import CompilerError, System, build_library, host

_VARIABLES = [
    ("time", "independent", ""), ("u", "input", "mA"), ("x", "output", "mm"),
    ("v", "output", "mm/s"), ("a", "output", "mm/s2"),
    *((name, "parameter", "") for name in ("m", "force", "push", "onset", "reach", "rebound")),
    ("misdeed", "parameter", ""), ("hits", "output", ""),
]  # fmt: skip
"""Name, causality and unit, in the order of the value references in `slide.c`."""

_STATES = {"x": ("v", 3), "v": ("a", 4)}
_STARTS = {"m": 1.0, "force": 1.0, "rebound": 0.0, "push": 0.0, "misdeed": 0.0, "u": 7.0}


def slide(version: int, file: Path, *, interface: str = "ModelExchange") -> Path:
    """Compile the slide for a version of FMI; skip where that cannot be done."""
    system = host()
    if system is None or not system.fmi2:
        pytest.skip("FMI 2.0 has no name for this system")
    library = file.with_suffix(system.suffix)
    source = Path(__file__).with_name("slide.c")
    try:
        build_library([source], library, system, ["-D_GNU_SOURCE", f"-DFMI={version}"])
    except CompilerError as error:
        pytest.skip(str(error))
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("modelDescription.xml", _description(version, interface))
        archive.write(library, f"binaries/{_folder(version, system)}/slide{system.suffix}")
    return file


def _folder(version: int, system: System) -> str:
    return system.fmi2 if version == 2 else system.name


def _description(version: int, interface: str) -> str:
    lines = []
    for place, (name, causality, unit) in enumerate(_VARIABLES):
        kind = "continuous" if causality in ("input", "output", "independent") else "fixed"
        head = (
            f'name="{name}" valueReference="{place}" causality="{causality}" variability="{kind}"'
        )
        start = f' start="{_STARTS.get(name, 1e9)}"' if causality in ("parameter", "input") else ""
        number = f" unit={quoteattr(unit)}{start}" if unit else start
        derives = [s for s, (_, rate) in _STATES.items() if rate == place]
        if derives:
            state = next(i for i, v in enumerate(_VARIABLES) if v[0] == derives[0])
            number += f' derivative="{state + (version == 2)}"'
        lines.append(
            f"<ScalarVariable {head}><Real{number}/></ScalarVariable>"
            if version == 2
            else f"<Float64 {head}{number}/>"
        )
    units = "".join(
        f'<Unit name="{name}"><BaseUnit {base} factor="0.001"/></Unit>'
        for name, base in (("mA", 'A="1"'), ("mm", 'm="1"'), ("mm/s", 'm="1" s="-1"'),
                           ("mm/s2", 'm="1" s="-2"'))
    )  # fmt: skip
    if version == 2:
        structure = (
            '<Outputs><Unknown index="3"/><Unknown index="4"/><Unknown index="5"/>'
            '<Unknown index="13"/></Outputs>'
            '<Derivatives><Unknown index="4"/><Unknown index="5"/></Derivatives>'
        )
        root = 'fmiVersion="2.0" guid="{slide}" numberOfEventIndicators="1"'
    else:
        structure = "".join(f'<Output valueReference="{i}"/>' for i in (2, 3, 4, 12))
        structure += "".join(f'<ContinuousStateDerivative valueReference="{i}"/>' for i in (3, 4))
        root = 'fmiVersion="3.0" instantiationToken="{slide}"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription modelName="slide" {root}>'
        f'<{interface} modelIdentifier="slide"/><UnitDefinitions>{units}</UnitDefinitions>'
        f"<ModelVariables>{''.join(lines)}</ModelVariables>"
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )
