"""A rotary axis in rotary units: angles, torques, inertias, and logs of them."""

import dataclasses
import math
from pathlib import Path

import pytest

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.units import axis, to_si

VANE = """
[rig]
motion = "rotary"
[supply]
pressure = "100 bar"
[valve]
nominal_flow = "10 l/min"
rated_current = "10 mA"
pressure_drop_total = "70 bar"
natural_frequency = "100 Hz"
[cylinder]                           # a vane of 60 cm^3/rad that turns by 270 degrees
piston_area = "60 cm^3/rad"
area_ratio = 1
stroke = "270 deg"
dead_volume_a = "20 ml"
dead_volume_b = "20 ml"
end_stops = "1e5 N*m/rad"
[oil]
bulk_modulus = "1300 MPa"
[friction]
viscous_friction = "2 N*m*s/rad"
coulomb_friction = "5 N*m"
[load]
mass = "0.8 kg*m^2"
gravity = "12 N*m"
[initial]
position = "135 deg"
[sensors.position]
resolution = "0.01 deg"
"""


def written(folder: Path, text: str) -> Path:
    """Return a file with a text."""
    file = folder / "vane.toml"
    file.write_text(text)
    return file


def test_a_rotary_axis_is_stated_in_its_own_units(tmp_path: Path) -> None:
    """Numbers are those in rad, N m, kg m² and m³/rad."""
    config = load([written(tmp_path, VANE)])
    assert config.rotary
    plant = config.plant
    assert plant["cylinder_piston_area"] == pytest.approx(60e-6)
    assert plant["cylinder_stroke"] == pytest.approx(1.5 * math.pi)
    assert plant["initial_position"] == pytest.approx(0.75 * math.pi)
    assert plant["load_mass"] == pytest.approx(0.8)
    assert plant["gravity_force"] == pytest.approx(12.0)
    assert plant["coulomb_friction_force"] == pytest.approx(5.0)
    assert plant["viscous_friction_coefficient"] == pytest.approx(2.0)
    assert plant["end_stops_stiffness"] == pytest.approx(1e5)
    assert config.sensors["position"]["resolution_step"] == pytest.approx(math.radians(0.01))


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("30 rpm", "m/s", math.pi),
        ("90 deg/s", "m/s", math.pi / 2),
        ("2 kN*m", "N", 2000.0),
        ("1 turn", "m", 2 * math.pi),
        ("60 mm", "m", 0.06),
        ("3 Nm/rad", "N/m", 3.0),
    ],
)
def test_units_of_turning_are_read(text: str, unit: str, value: float) -> None:
    """Units of lengths are read as well, such as that of a line."""
    with axis(rotary=True):
        assert to_si(text, unit) == pytest.approx(value)


@pytest.mark.parametrize(("text", "unit"), [("5 %", "m"), ("3", "m"), ("2 Hz", "m/s")])
def test_what_has_the_same_dimension_is_no_angle(text: str, unit: str) -> None:
    """A share, a plain number and a frequency are refused for an angle or its rate."""
    with axis(rotary=True), pytest.raises(ValueError, match=r"is wanted|cannot be read"):
        to_si(text, unit)


def test_a_linear_axis_takes_no_angle(tmp_path: Path) -> None:
    """Without `motion` an angle is no position, also after a rotary axis has been loaded."""
    file = written(tmp_path, VANE)
    load([file])
    with pytest.raises(UserError, match='stroke: "270 deg" is a'):
        load([written(tmp_path, VANE.replace('motion = "rotary"', ""))])


def test_logs_of_a_rotary_axis_have_their_units(tmp_path: Path) -> None:
    """`position [deg]` and `load_force [Nm]` become rad and N m; a linear axis refuses them."""
    config = load([written(tmp_path, VANE)])
    log = tmp_path / "log.csv"
    rows = [f"{1e-3 * k},1,{k % 90},{2 + k % 3}" for k in range(50)]
    header = "time [s],valve_current [mA],position [deg],load_force [Nm]"
    log.write_text("\n".join([header, *rows]) + "\n")
    (experiment,) = experiments([log], config, Meaning())
    assert experiment.readings["position"][45] == pytest.approx(math.radians(45))
    assert experiment.readings["load_force"][4] == pytest.approx(3.0)
    with pytest.raises(UserError, match="deg"):
        experiments([log], dataclasses.replace(config, rotary=False), Meaning())
