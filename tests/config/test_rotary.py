"""A rotary axis in rotary units: angles, torques, inertias, and logs of them."""

import dataclasses
import math
import re
from pathlib import Path

import pytest

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.identify.conclusion.findings import shown_unit
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.model.effects.lines import cylinder_lines
from hil_emulator.platform.paths import shipped
from hil_emulator.scenario.loading import runs_of
from hil_emulator.scenario.perform import perform
from hil_emulator.simulation.emulator import Emulator, NeverHeldError
from hil_emulator.units import axis, factor, read_as, show, to_si
from tests.identify.rig_data import knee_model

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


TURN = """
title = "Turn"
config = ["vane.toml"]
duration = "60 ms"
[[step]]
at = "10 ms"
nmt = "start"
set = { position = "150 deg", external_force = "2 N*m" }
[[step]]
when = "position > 135.5 deg"
fault = "position offset value='3 deg'"
[[step]]
at = "20 ms"
fault = "cylinder friction_jump force='3 N*m'"
[[expect]]
signal = "model.position"
within = ["120 deg", "130 deg"]
by = "50 ms"
"""


def test_a_scenario_of_a_rotary_axis_is_in_its_units(tmp_path: Path) -> None:
    """Set points, conditions, faults and bands, and what the outcome reports."""
    node = f'[[node]]\nid = 5\neds = "{shipped("eds/hydraulic_actuator.eds")}"\n'
    written(tmp_path, VANE + node)
    (tmp_path / "turn.toml").write_text(TURN)
    outcome = perform(tmp_path / "turn.toml")
    (check,) = outcome.checks
    assert check.text == "model.position in 120 deg ... 130 deg by 0.05 s"
    assert re.fullmatch(r"never, last 1[34]\d\.\d+ deg", check.observed)
    assert "position 150 deg, external_force 2 N*m" in outcome.events[0][1]
    assert outcome.rotary
    assert {"position offset", "cylinder friction_jump"} <= {text for _, text in outcome.events}
    linear = VANE.replace('motion = "rotary"', "")
    written(tmp_path, linear + node)
    with pytest.raises(UserError, match='"150 deg" is a'):
        runs_of(tmp_path / "turn.toml")


def test_an_emulator_in_python_takes_the_units_of_its_axis(tmp_path: Path) -> None:
    """Of two rigs each takes its own; a message is in deg."""
    node = f'[[node]]\nid = 5\neds = "{shipped("eds/hydraulic_actuator.eds")}"\n'
    vane = load([written(tmp_path, VANE + node)])
    knee = load([shipped("configs/hyq_knee.toml")])
    with Emulator(vane) as turned, Emulator(knee) as moved:
        assert turned.fault("position", "offset", value="30 deg").fault.values == {
            "value": pytest.approx(math.pi / 6)
        }
        with axis(rotary=True):
            words = turned.fault("position", "offset", value="30 deg").fault.words
        assert words == "position offset, value 30 deg"
        with pytest.raises(UserError, match="length is wanted, such as"):
            moved.fault("position", "offset", value="90 deg")
        with pytest.raises(UserError, match=r"length or angle is wanted, such as .* deg"):
            turned.fault("position", "offset", value="3 bar")
        with pytest.raises(NeverHeldError, match=r"position = \d+(\.\d+)? deg"):
            turned.wait_until("position > 200 deg", within="2 ms")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (math.pi, "m", "180 deg"), (math.pi, "m/s", "180 deg/s"), (5.0, "N", "5 N*m"),
        (0.8, "kg", "0.8 kg*m^2"), (6e-5, "m^2", "60 cm^3/rad"), (2.0, "N*s/m", "2 N*m*s/rad"),
        (1e5, "N/m", "100000 N*m/rad"), (1e7, "Pa", "100 bar"),
    ],
)  # fmt: skip
def test_quantities_of_a_rotary_axis_are_read_in_its_units(
    value: float, unit: str, text: str
) -> None:
    """And what is shown is read back as the same number."""
    with axis(rotary=True):
        assert show(value, unit, read_as(unit)) == text
        assert to_si(text, unit) == pytest.approx(value)
        assert factor(unit, read_as(unit)) == pytest.approx(value / float(text.split()[0]))
    assert read_as("m") == "mm"


def test_findings_of_a_rotary_axis_are_in_its_units() -> None:
    """Inertia and friction; the diameter of a hose stays a length."""
    mass = next(c for c in parameters.ordinary(knee_model()) if c.name == "load_mass")
    hose = dataclasses.replace(mass, unit="m", shown="mm", effect=cylinder_lines)
    with axis(rotary=True):
        assert (shown_unit(mass), shown_unit(hose)) == ("kg*m^2", "mm")
    assert (shown_unit(mass), shown_unit(hose)) == ("kg", "mm")


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
