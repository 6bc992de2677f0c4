"""Tolerances of a configuration's numbers, one by one or for a whole table."""

import math
from pathlib import Path

import pytest

from hil_emulator.config.load import Configuration, load
from hil_emulator.errors import UserError
from tests.identify.rig_data import KNEE


def laid_over(folder: Path, *texts: str) -> Configuration:
    """Return the reference machine with layers of text over it."""
    files = []
    for i, text in enumerate(texts):
        files.append(folder / f"layer{i}.toml")
        files[-1].write_text(text)
    return load([KNEE, *files])


def test_a_tolerance_leaves_the_value_as_it_is(tmp_path: Path) -> None:
    """The simulation uses the plain value; the tolerance is kept by the parameter's name."""
    config = laid_over(tmp_path, '[load]\nmass = { value = "60 kg", tolerance = "10 %" }\n')
    assert config.plant["load_mass"] == 60.0
    assert config.tolerances == {"load_mass": pytest.approx(0.1)}


def test_an_effect_has_one_as_well(tmp_path: Path) -> None:
    """It is given with the short form of its strength, or with one of its parameters."""
    text = (
        '[friction]\ncoulomb_friction = { value = "80 N", tolerance = 0.5 }\n'
        'stribeck_friction = { excess = "20 N", '
        'stribeck_velocity = { value = "9 mm/s", tolerance = "40 %" } }\n'
    )
    config = laid_over(tmp_path, text)
    assert config.plant["coulomb_friction_force"] == 80.0
    assert config.plant["stribeck_friction_stribeck_velocity"] == pytest.approx(9e-3)
    assert config.tolerances == {
        "coulomb_friction_force": pytest.approx(0.5),
        "stribeck_friction_stribeck_velocity": pytest.approx(0.4),
    }


def test_a_tolerance_of_a_table_holds_for_its_values(tmp_path: Path) -> None:
    """Values with a tolerance, and those of another file, are excepted."""
    text = (
        '[cylinder]\ntolerance = "30 %"\ndead_volume_a = "2 ml"\n'
        'dead_volume_b = { value = "2 ml", tolerance = "5 %" }\n'
    )
    config = laid_over(tmp_path, text)
    assert config.tolerances == {
        "cylinder_dead_volume_a": pytest.approx(0.3),
        "cylinder_dead_volume_b": pytest.approx(0.05),
    }


def test_tolerances_of_a_valve_sheet_are_combined(tmp_path: Path) -> None:
    """K_v = q/(u sqrt(dp)) (S1 eq. 3.8): relative errors add by squares, the drop's halved."""
    text = (
        '[valve]\nnominal_flow = { value = "7.5 l/min", tolerance = "6 %" }\n'
        'pressure_drop_total = { value = "70 bar", tolerance = "16 %" }\n'
    )
    assert laid_over(tmp_path, text).tolerances == {"valve_gain": pytest.approx(0.10)}


def test_a_replaced_value_does_not_inherit_a_tolerance(tmp_path: Path) -> None:
    """A tolerance belongs to one value only."""
    first = '[load]\nmass = { value = "60 kg", tolerance = "10 %" }\n'
    assert not laid_over(tmp_path, first, '[load]\nmass = "61 kg"\n').tolerances


def test_stated_values_are_distinguished_from_defaults(tmp_path: Path) -> None:
    """The reference machine states its damping ratio, and not its oil's viscosity."""
    config = laid_over(tmp_path, "")
    assert "valve_damping_ratio" in config.stated
    assert "coulomb_friction_force" in config.stated
    assert "oil_kinematic_viscosity" not in config.stated
    assert math.isfinite(config.plant["oil_kinematic_viscosity"])


@pytest.mark.parametrize("size", ['"-1 %"', '"2000 %"', '"3 mm"', '"much"', "nan", "{}"])
def test_a_wrong_tolerance_is_one_message(tmp_path: Path, size: str) -> None:
    """The message names the place and the expected form."""
    with pytest.raises(UserError, match=r"load\.mass\.tolerance") as error:
        laid_over(tmp_path, f'[load]\nmass = {{ value = "60 kg", tolerance = {size} }}\n')
    assert "%" in str(error.value)
