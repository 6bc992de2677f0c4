"""An exported FMU for the whole session."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hil_emulator.ccode.compiler import host
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
    export_fmu([KNEE], file, version, c_only=False, single=False, every_effect=False)
    own = host()
    import zipfile

    if own is None or not any(n.endswith(own.suffix) for n in zipfile.ZipFile(file).namelist()):
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
