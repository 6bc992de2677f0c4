"""Dependencies point one way."""

import ast
from pathlib import Path

import pytest

import hil_emulator

PACKAGE = Path(hil_emulator.__file__).parent
OWN = "hil_emulator"

# What each part may import, besides the standard library and itself.
ALLOWED = {
    "model": {"numpy", "numba", "scipy"},
    "device": {"canopen", f"{OWN}.frame", f"{OWN}.errors"},
    "bus": {"can", f"{OWN}.frame", f"{OWN}.errors"},
    "export": {"cantools", "canopen", f"{OWN}.device", f"{OWN}.errors"},
    "config": {"pydantic", f"{OWN}.model", f"{OWN}.units", f"{OWN}.errors"},
    "faults": {
        f"{OWN}.condition", f"{OWN}.device", f"{OWN}.model", f"{OWN}.frame", f"{OWN}.units",
        f"{OWN}.errors",
    },
    "recording": {
        "numpy", f"{OWN}.bus", f"{OWN}.condition", f"{OWN}.config", f"{OWN}.device",
        f"{OWN}.model", f"{OWN}.record", f"{OWN}.frame", f"{OWN}.units", f"{OWN}.errors",
        f"{OWN}.__version__",
    },
    "captures": {
        "numpy", "cantools", f"{OWN}.bus", f"{OWN}.device", f"{OWN}.recording", f"{OWN}.identify",
        f"{OWN}.frame", f"{OWN}.units", f"{OWN}.errors",
    },
    "remote": {
        f"{OWN}.faults", f"{OWN}.record", f"{OWN}.settings", f"{OWN}.errors",
    },
    "identify": {
        "numpy", "numba", "scipy", "threadpoolctl", "matplotlib",
        f"{OWN}.model", f"{OWN}.config", f"{OWN}.units", f"{OWN}.errors",
        f"{OWN}.record", f"{OWN}.places", f"{OWN}.cluster",
    },
    "characterise": {
        "numpy", "scipy", "matplotlib", f"{OWN}.model", f"{OWN}.units", f"{OWN}.errors",
    },
}  # fmt: skip

# Modules by which time, threads and randomness would come in unasked.
FORBIDDEN = {
    "model": {"time", "threading", "random", "logging", "socket", "asyncio"},
    "device": {"time", "threading", "random", "socket", "asyncio", "datetime", "can"},
}


def imports(file: Path) -> set[str]:
    """Return the modules a file imports, relative ones spelt out."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def begins(module: str, prefixes: set[str]) -> bool:
    """Tell whether a module is one of some packages or inside them."""
    return any(module == p or module.startswith(f"{p}.") for p in prefixes)


def files(part: str) -> list[Path]:
    """Return the files of a part of the package."""
    return sorted((PACKAGE / part).rglob("*.py"))


def third_party(modules: set[str]) -> set[str]:
    """Return the modules that neither Python brings nor the interpreter's own library."""
    import sys

    return {m for m in modules if m.split(".")[0] not in sys.stdlib_module_names}


@pytest.mark.parametrize("part", ALLOWED)
def test_a_part_imports_only_what_lies_below_it(part: str) -> None:
    """No part of the package reaches up to, or across to, a part it may not know."""
    for file in files(part):
        for module in third_party(imports(file)):
            allowed = ALLOWED[part] | {f"{OWN}.{part}"}
            assert begins(module, allowed), f"{file.name} of {part} imports {module}"


@pytest.mark.parametrize("part", FORBIDDEN)
def test_a_part_cannot_tell_the_time(part: str) -> None:
    """Physics and device get time and randomness handed in; they cannot take them."""
    for file in files(part):
        taken = {m for m in imports(file) if begins(m, FORBIDDEN[part])}
        assert not taken, f"{file.name} of {part} imports {taken}"


def test_only_the_bus_touches_python_can() -> None:
    """A frame enters and leaves through one door."""
    outside = [f for f in PACKAGE.rglob("*.py") if "bus" not in f.relative_to(PACKAGE).parts]
    touching = [f.name for f in outside if any(begins(m, {"can"}) for m in imports(f))]
    assert touching == []


def test_only_the_outermost_layer_knows_the_rig() -> None:
    """Who imports the rig knows everybody; that is left to the commands and what they run."""
    outer = {"commands", "demo", "bench", "scenario", "testing", "conformance"}
    for file in PACKAGE.rglob("*.py"):
        if file.relative_to(PACKAGE).parts[0] not in outer | {
            "__main__.py",
            "rig.py",
            "machine.py",
        }:
            assert not any(begins(m, {f"{OWN}.rig"}) for m in imports(file)), file
