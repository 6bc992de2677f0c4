"""What comes with the package is named without a path, and copied whole."""

import tomllib
from pathlib import Path

import pytest

from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.platform.packaged import CONFIGURATIONS, Purpose, copy, found, packaged
from hil_emulator.scenario import loading


@pytest.mark.parametrize("name", packaged(Purpose.MACHINE))
def test_a_copied_machine_is_whole_in_an_empty_folder(name: str, tmp_path: Path) -> None:
    """The copy equals the packaged configuration, and needs no file outside its folder."""
    first, *others = copy(name, tmp_path)
    original, copied = load_machine([packaged()[name]]), load_machine([first])
    assert [a.config.plant for a in copied.actuators] == [
        a.config.plant for a in original.actuators
    ]
    for actuator in copied.actuators:
        assert all(node.eds.resolve().parent == tmp_path for node in actuator.config.nodes)
    assert {f.parent for f in others} == {tmp_path}


@pytest.mark.parametrize("name", packaged(Purpose.SCENARIO))
def test_a_copied_scenario_brings_its_machine(name: str, tmp_path: Path) -> None:
    """Its configuration files and profiles are copied into the same folder."""
    scenario = loading.load(copy(name, tmp_path)[0])
    assert all((tmp_path / file).is_file() for file in scenario.config)
    profiles = [step.profile.file for step in scenario.steps if step.profile]
    assert all((tmp_path / file).is_file() for file in profiles)


def test_a_bench_brings_its_logs(tmp_path: Path) -> None:
    """The friction rig comes with its twelve measured logs and their licence."""
    names = {file.suffix for file in copy("friction_rig", tmp_path)}
    assert names == {".toml", ".csv", ""}
    assert len(list(tmp_path.glob("*.csv"))) == 12


def test_a_copy_that_the_user_has_changed_is_overwritten_on_request_only(tmp_path: Path) -> None:
    """Twice the same is harmless; a changed file is refused, and no other file is written."""
    file, *others = copy("hyq_knee", tmp_path)
    copy("hyq_knee", tmp_path)
    file.write_text("mine")
    others[0].unlink()
    with pytest.raises(UserError, match="exists already; choose another name, or add --overwrite"):
        copy("hyq_knee", tmp_path)
    assert file.read_text() == "mine"
    assert not others[0].exists()
    copy("hyq_knee", tmp_path, overwrite=True)
    assert "mine" not in file.read_text()


def test_names_stand_for_one_file_each() -> None:
    """No packaged file hides another, and a wrong name lists the right ones."""
    root = packaged()["hyq_knee"].parent
    assert len(packaged()) == len({*root.rglob("*.toml"), *root.glob("*.eds"),
                                   *root.parent.glob("eds/*.eds")})  # fmt: skip
    with pytest.raises(UserError, match=r"hyq_kne is no file.* hyq_knee,"):
        found("hyq_kne", Purpose.MACHINE)
    for name in packaged(*CONFIGURATIONS):
        assert tomllib.loads(found(name).read_text(encoding="utf-8"))
