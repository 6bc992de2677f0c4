"""The JSON Schema of the files, checked by an editor's checker."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hil_emulator.commands.init import default_answer
from hil_emulator.config.json_schema import json_schema
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.machines.questions import answered
from hil_emulator.machines.writing import configuration
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.quantities import PARAMS
from hil_emulator.platform.paths import shipped

REFERENCE = shipped("configs/hyq_knee.toml")
CONFIGS = REFERENCE.parent
TAPLO = shutil.which("taplo", path=str(Path(sys.executable).parent)) or shutil.which("taplo")
MACHINES = [file for file in CONFIGS.glob("*.toml") if "[[actuator]]" in file.read_text()]
SHIPPED = sorted({*CONFIGS.glob("*.toml"), *CONFIGS.glob("benches/*.toml")} - {*MACHINES})

needs_taplo = pytest.mark.skipif(TAPLO is None, reason="taplo is not installed")


@pytest.fixture(scope="module")
def schemas(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the files of both schemas."""
    folder = tmp_path_factory.mktemp("schemas")
    files = {what: folder / f"{what}.json" for what in ("configuration", "machine")}
    for what, file in files.items():
        file.write_text(json.dumps(json_schema(what)))
    return files


def complaints(schema: Path, *files: Path) -> str:
    """Return taplo's messages about files."""
    assert TAPLO is not None
    command = [TAPLO, "lint", "--schema", schema.as_uri(), *map(str, files)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    return result.stderr if result.returncode else ""


@needs_taplo
def test_every_shipped_file_fits_its_schema(schemas: dict[str, Path]) -> None:
    """An editor accepts every file of the package."""
    assert complaints(schemas["configuration"], *SHIPPED) == ""
    assert complaints(schemas["machine"], *MACHINES) == ""


@needs_taplo
@pytest.mark.parametrize(
    "text",
    [
        "[supply]\npressure = 160",
        '[supply]\npressure = "160"',
        '[supply]\npressure = "160 mm"',
        '[load]\nmas = "3 kg"',
        '[load]\nmass = "3 s"',
        "[valve]\ndamping_ratio = 7",
        '[friction]\ncoulomb_friction = "100 mm"',
        '[friction]\ncoulomb_friction = { froce = "100 N" }',
        '[sensors.position]\nnoise = "3 bar"',
        '[node]\nid = 3\neds = "x"',
        '[[node]]\nid = 0\neds = "x"',
        "[[node]]\nid = 3",
        '[bench]\nkind = "laboratory"',
        '[load]\nmass = { value = "3 s", tolerance = "10 %" }',
        '[load]\nmass = { value = "3 kg", tolerance = "10 kg" }',
        '[load]\nmass = { value = "3 kg", tolerance = "10 %", source = "me" }',
        '[friction]\ncoulomb_friction = { force = "9 N", tolerance = "1 bar" }',
        '[sensors.position]\nnoise = { value = "1 um", tolerance = "10 %" }',
    ],
)
def test_an_editor_sees_what_loading_refuses(
    schemas: dict[str, Path], tmp_path: Path, text: str
) -> None:
    """A mistake that the schema finds is one that loading finds, too."""
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    assert "wrong.toml" in complaints(schemas["configuration"], file)
    with pytest.raises(UserError):
        load([REFERENCE, file])


@needs_taplo
@pytest.mark.parametrize(
    "text",
    [
        '[supply]\npressure = "2.3e3 psi"',
        '[supply]\npressure = "16 N/mm^2"',
        '[oil]\ntemperature = "60 °C"',
        '[friction]\ncoulomb_friction = "off"',
        '[friction]\nstribeck_friction = { excess = "60 N", stribeck_velocity = "1 cm/s" }',
        '[valve]\nunderlap = "0.02 mA"\ndamping_ratio = 0.9\nspool_rate_limit = "inf A/s"',
        '[valve]\ndamping_ratio = "90 %"',
        '[[node]]\nid = "unconfigured"\neds = "x"\nmap = { "0x6130:1" = "pressure_a" }',
        '[bus]\ninterface = "kvaser"\nreceive_own_messages = true',
        '[bench]\nkind = "force balance"\npressure_b = "absent"',
        '[load]\nmass = { value = "3 kg", tolerance = "10 %" }',
        '[load]\ntolerance = 0.2\nmass = "3 kg"',
        '[friction]\ncoulomb_friction = { value = "9 N", tolerance = "30 %" }',
        '[friction]\nstribeck_friction = { excess = "60 N", tolerance = "30 %" }',
        '[oil]\nentrained_air = { fraction = { value = "1 %", tolerance = "50 %" } }',
        "[valve]\ndamping_ratio = { value = 0.9, tolerance = 0.1 }",
        '[cylinder]\nend_stops = "off"',
    ],
)
def test_an_editor_lets_pass_what_loads(
    schemas: dict[str, Path], tmp_path: Path, text: str
) -> None:
    """The schema refuses nothing that loading takes."""
    file = tmp_path / "right.toml"
    file.write_text(text)
    load([REFERENCE, file])
    assert complaints(schemas["configuration"], file) == ""


@needs_taplo
def test_files_of_init_fit_the_schema(schemas: dict[str, Path], tmp_path: Path) -> None:
    """With the tolerances of assumed values, and an accumulator."""
    answers = answered({"pump": "fixed", "accumulator": "1 l"}, default_answer)
    file = tmp_path / "machine.toml"
    file.write_text(configuration(answers, "machine.eds", "schema.json", 20e-6))
    assert "tolerance" in file.read_text()
    assert complaints(schemas["configuration"], file) == ""


def described(node: Any) -> Iterator[tuple[str, str]]:
    """Yield each quantity's key and description."""
    if isinstance(node, dict):
        for key, inner in node.get("properties", {}).items():
            if "pattern" in json.dumps(inner):
                yield key, inner.get("description", "")
        for inner in node.values():
            yield from described(inner)


def test_every_quantity_is_described() -> None:
    """The schema has meaning, bounds, usual value and source of each parameter and effect."""
    entries = list(described(json_schema("configuration")))
    for param in (p for table in PARAMS.values() for p in table):
        assert any(key == param.name and param.meaning in text for key, text in entries), param
    for effect in CATALOGUE:
        assert any(key == effect.name and effect.source in text for key, text in entries), effect
    for key, text in entries:
        assert re.search(r" \.\.\. .*, typically .*\n(.*\n)*source: ", text), key
