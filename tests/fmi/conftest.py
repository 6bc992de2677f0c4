"""An exported FMU for the whole session."""

import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hil_emulator.ccode.compiler import CompilerError, build_library, host
from hil_emulator.commands.export_fmu import export_fmu
from hil_emulator.platform.paths import shipped

if TYPE_CHECKING:
    from tests.fmi.instance import Run

KNEE = shipped("configs/hyq_knee.toml")


@pytest.fixture(scope="session", params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def knee_fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Export the reference machine; skip where nothing can be compiled."""
    pytest.importorskip("fmpy")
    version: int = request.param
    file = tmp_path_factory.mktemp("fmu") / f"knee{version}.fmu"
    export_fmu([KNEE], file, version, c_only=False, single=False, every_effect=False, native=True)
    system = host()
    if system is None or not any(
        n.endswith(system.suffix) for n in zipfile.ZipFile(file).namelist()
    ):
        pytest.skip("no C compiler for this system")
    return file


@pytest.fixture
def run(knee_fmu: Path, tmp_path: Path) -> "Iterator[Run]":
    """Return an instance that is freed in the end."""
    from tests.fmi.instance import Run

    made = Run(knee_fmu, tmp_path)
    yield made
    made.fmu.terminate()
    made.fmu.freeInstance()


@pytest.fixture(scope="session")
def crane(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile the crane; skip where there is no compiler, or no name for this system."""
    pytest.importorskip("fmpy")
    system = host()
    if system is None or not system.fmi2:
        pytest.skip("FMI 2.0 has no name for this system")
    file = tmp_path_factory.mktemp("crane") / "crane.fmu"
    library = file.with_suffix(system.suffix)
    try:
        build_library([Path(__file__).parent / "crane.c"], library, system, ["-D_GNU_SOURCE"])
    except CompilerError as error:
        pytest.skip(str(error))
    with zipfile.ZipFile(file, "w") as archive:
        archive.write(Path(__file__).parent / "crane.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{system.fmi2}/crane{system.suffix}")
    return file


@pytest.fixture
def unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder into which this process and its children unpack FMUs."""
    folder = tmp_path / "unpacked"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return folder
