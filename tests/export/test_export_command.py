"""`hil-emulator export` on the command line."""

from pathlib import Path

import cantools
import pytest
from click.testing import CliRunner, Result

from hil_emulator.__main__ import main
from hil_emulator.platform.paths import shipped

KNEE = shipped("configs/hyq_knee.toml")
SEPARATE = shipped("configs/hyq_knee_separate.toml")


def export(*arguments: object) -> Result:
    """Run the command."""
    return CliRunner().invoke(main, ["export", *map(str, arguments)])


def test_it_names_what_it_writes(tmp_path: Path) -> None:
    """Each line of the output is a file that is there."""
    result = export(KNEE, SEPARATE, "--out", tmp_path / "made")
    assert result.exit_code == 0, result.output
    written = {Path(line).name for line in result.output.splitlines()}
    assert written == {path.name for path in (tmp_path / "made").iterdir()}
    assert len(written) == 2 * 4 + 1


def machine(folder: Path, *actuators: tuple[str, str, int]) -> Path:
    """Write a machine of actuators in the separate layout: name, bus, offset of the node-IDs."""
    text = '[buses.left]\ninterface = "virtual"\n[buses.right]\ninterface = "virtual"\n'
    for name, bus, offset in actuators:
        text += (
            f'[[actuator]]\nname = "{name}"\nfiles = ["{KNEE}", "{SEPARATE}"]\n'
            f'bus = "{bus}"\nnode_offset = {offset}\n'
        )
    path = folder / "machine.toml"
    path.write_text(text)
    return path


def test_every_bus_has_its_database(tmp_path: Path) -> None:
    """Eight nodes on the left, four on the right, without duplicates."""
    path = machine(tmp_path, ("hip", "left", 0), ("knee", "left", 4), ("other", "right", 0))
    assert export(path, "--out", tmp_path / "made").exit_code == 0
    left, right = (
        cantools.database.load_file(tmp_path / f"made/{n}.dbc") for n in ("left", "right")
    )
    assert (len(left.nodes), len(right.nodes)) == (8 + 1, 4 + 1)
    assert len(list((tmp_path / "made").glob("*.eds"))) == 12
    assert {"hip_load_cell_6_TPDO1", "knee_load_cell_10_TPDO1"} <= {m.name for m in left.messages}


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_a_folder_that_cannot_be_is_named(tmp_path: Path, out: str) -> None:
    """One message and exit code 2."""
    (tmp_path / "file").write_text("")
    result = export(KNEE, "--out", tmp_path / out)
    assert result.exit_code == 2
    assert "Traceback" not in result.output
