"""From files to a configuration."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from hil_emulator.config.bus import DEFAULT_BUS
from hil_emulator.config.datasheet import LINES
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.stages import SAMPLED
from hil_emulator.platform.paths import shipped

REFERENCE = shipped("configs/hyq_knee.toml")

Layer = Callable[[str], Path]


@pytest.fixture
def layer(tmp_path: Path) -> Layer:
    """Return a function that writes a configuration file."""

    def write(text: str) -> Path:
        file = tmp_path / f"layer{len(list(tmp_path.iterdir()))}.toml"
        file.write_text(text)
        return file

    return write


def mistakes(*files: Path) -> list[str]:
    """Return the lines of the message with which loading ends."""
    with pytest.raises(UserError) as caught:
        load(files)
    return str(caught.value).splitlines()[1:] or [str(caught.value)]


def test_the_reference_machine_has_the_published_numbers() -> None:
    """HyQ's knee: 160 bar, 1300 MPa, alpha 0.61, 80 mm, 50 kg, 500 and 1000 N s/m, 100 N."""
    plant = load([REFERENCE]).plant
    expected = {
        "supply_pressure": 160e5,
        "oil_bulk_modulus": 1.3e9,
        "cylinder_piston_area": math.pi * 0.016**2 / 4,
        "cylinder_area_ratio": 0.61,
        "cylinder_stroke": 0.08,
        "load_mass": 50.0,
        "load_viscous_friction_coefficient": 500.0,
        "viscous_friction_coefficient": 1000.0,
        "coulomb_friction_force": 100.0,
    }
    assert {name: plant[name] for name in expected} == pytest.approx(expected, rel=1e-4)
    assert load([REFERENCE]).sensors["load_force"]["measuring_range_upper"] == 5000.0


def test_the_spool_stops_where_the_valve_is_fully_open(layer: Layer) -> None:
    """It stops at the rated current unless the configuration gives a travel or "off"."""
    assert load([REFERENCE]).plant["spool_stops_limit"] == pytest.approx(0.01)
    given = layer('[valve]\nspool_stops = "11 mA"')
    assert load([REFERENCE, given]).plant["spool_stops_limit"] == pytest.approx(0.011)
    off = layer('[valve]\nspool_stops = "off"')
    assert math.isinf(load([REFERENCE, off]).plant["spool_stops_limit"])


BARE = """
[supply]
pressure = "160 bar"
[valve]
gain = "6.68e-6 m^3/(s*A*Pa^0.5)"
natural_frequency = "250 Hz"
[oil]
bulk_modulus = "1300 MPa"
[cylinder]
bore = "40 mm"
rod = "28 mm"
stroke = "200 mm"
dead_volume_a = "20 ml"
dead_volume_b = "20 ml"
[load]
mass = "50 kg"
[initial]
position = "100 mm"
"""


def test_a_cylinder_has_ends(layer: Layer) -> None:
    """Steel of a fifth of the piston's area, as long as the stroke: k = E A/L, 2.6e8 N/m here."""
    area = math.pi * 0.040**2 / 4
    assert load([layer(BARE)]).plant["end_stops_stiffness"] == pytest.approx(
        210e9 * 0.2 * area / 0.2
    )
    off = layer('[cylinder]\nend_stops = "off"')
    assert load([layer(BARE), off]).plant["end_stops_stiffness"] == 0.0


def test_a_light_mass_meets_ends_that_the_step_can_follow(layer: Layer) -> None:
    """sqrt(k/m) h is half a radian at most: 6.25e7 N/m for 0.1 kg at 20 us."""
    light = layer('[load]\nmass = "0.1 kg"')
    assert load([layer(BARE), light]).plant["end_stops_stiffness"] == pytest.approx(6.25e7)


@pytest.mark.parametrize("name", ["pressure_drop_per_edge", "pressure_drop_total"])
def test_the_valve_gain_follows_from_either_pressure_drop(layer: Layer, name: str) -> None:
    """7.5 l/min at 10 mA: K_v = q_n / (u_n sqrt(dp_n1)), and dp_n2 = 2 dp_n1 (S1 eq. 3.7, 3.8)."""
    bar = 35 if name == "pressure_drop_per_edge" else 70
    over = layer(
        f'[valve]\nnominal_flow = "7.5 l/min"\nrated_current = "10 mA"\n{name} = "{bar} bar"'
    )
    gain = 7.5e-3 / 60 / (0.01 * math.sqrt(35e5))
    assert load([REFERENCE, over]).plant["valve_gain"] == pytest.approx(gain, rel=1e-12)


def test_bore_and_rod_displace_the_areas_of_an_earlier_file(layer: Layer) -> None:
    """A later file may give the same quantity by other keys; they replace the earlier ones."""
    over = layer('[cylinder]\nbore = "20 mm"\nrod = "12 mm"')
    plant = load([REFERENCE, over]).plant
    assert plant["cylinder_piston_area"] == pytest.approx(math.pi * 0.02**2 / 4)
    assert plant["cylinder_area_ratio"] == pytest.approx(1 - 0.6**2)


def test_later_files_are_laid_over_earlier_ones(layer: Layer) -> None:
    """A later file replaces the values that it contains and keeps the rest, in an effect too."""
    over = layer('[load]\nmass = "30 kg"\n[cylinder]\nend_stops = {damping = "5 s/m"}')
    plant = load([REFERENCE, over]).plant
    assert plant["load_mass"] == 30.0
    assert plant["end_stops_damping"] == 5.0
    assert plant["end_stops_stiffness"] == 1e8


def test_an_effect_can_be_switched_off(layer: Layer) -> None:
    """The word "off" is the value at which the effect vanishes."""
    over = layer('[friction]\ncoulomb_friction = "off"\n[valve]\nspool_rate_limit = "off"')
    plant = load([REFERENCE, over]).plant
    assert plant["coulomb_friction_force"] == 0.0
    assert plant["spool_rate_limit_rate"] == math.inf


@pytest.mark.parametrize("other", LINES)
def test_every_effect_of_the_catalogue_can_be_set(layer: Layer, other: frozenset[str]) -> None:
    """The schema accepts every effect in its table with its knob's typical value."""
    plain = [e for e in CATALOGUE if e.stage not in SAMPLED and e.name not in other]
    tables: dict[str, list[str]] = {}
    for e in plain:
        unit = "" if e.knob.unit == "1" else f" {e.knob.unit}"
        tables.setdefault(e.stage.table, []).append(f'{e.name} = "{e.knob.typical!r}{unit}"')
    text = "\n".join(f"[{t}]\n" + "\n".join(lines) for t, lines in tables.items())
    plant = load([REFERENCE, layer(text)]).plant
    for e in plain:
        assert plant[e.field_of(e.knob)] == pytest.approx(e.knob.typical), e.name


def test_a_sensor_effect_is_set_in_the_channels_own_unit(layer: Layer) -> None:
    """An offset of the load cell is a force, one of a pressure sensor a pressure."""
    over = layer('[sensors.load_force]\noffset = "12 N"\n[sensors.pressure_a]\noffset = "0.5 bar"')
    sensors = load([REFERENCE, over]).sensors
    assert sensors["load_force"]["offset_value"] == 12.0
    assert sensors["pressure_a"]["offset_value"] == pytest.approx(5e4)
    wrong = layer('[sensors.load_force]\noffset = "0.5 bar"')
    (line,) = mistakes(REFERENCE, wrong)
    assert "a force is wanted" in line


def test_all_mistakes_are_reported_at_once_each_with_its_remedy(layer: Layer) -> None:
    """Unknown key, wrong dimension, out of range and missing unit: four lines with paths."""
    over = layer(
        '[cylinder]\nstrok = "80 mm"\n[supply]\npressure = "160 mm"\n'
        '[load]\nmass = "-3 kg"\n[oil]\nbulk_modulus = 1300'
    )
    lines = "\n".join(mistakes(REFERENCE, over))
    assert 'cylinder.strok: unknown key; did you mean "stroke"?' in lines
    assert 'supply.pressure: "160 mm" is a length; a pressure is wanted, such as "160 bar"' in lines
    assert 'load.mass: "-3 kg" is outside the allowed 0.1 kg ... 100000 kg' in lines
    assert "oil.bulk_modulus: 1300 has no unit" in lines
    assert lines.count("layer0.toml: ") == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[valve]\ngain = "1e-6 m^3/(s*A*Pa^0.5)"\nrated_current = "1 mA"', "give either gain, or"),
        ('[cylinder]\nbore = "10 mm"\nrod = "12 mm"', "the rod must be thinner than the bore"),
        ('[lines]\ncylinder_lines = "1 m"\nline_waves = "1 m"', "give either cylinder_lines or"),
        ('[rig]\ntick = "1 ms"\nstep = "30 us"', "the nearest that fit: 990 us and 1020 us"),
        ('[rig]\ntick = "1 ms"\nsync_period = "0.2 ms"', "the nearest that fit: 1000 us"),
        ('[[node]]\nid = 0\neds = "x"', "node.0.id: 0 is no node-ID: 1 to 127"),
        ('[[node]]\nid = 3\neds = "x"\n[[node]]\nid = 3\neds = "x"', "two nodes have the ID 3"),
        ("[frction]\n", 'frction: unknown key; did you mean "friction"?'),
        ("[valve]\nreynolds_discharge = 200", "give critical_reynolds_number = 0.3 lambda_c"),
        (
            '[sensors.velocity]\nvelocity_estimator = "10 ms"\nlag = "1 ms"',
            "set it at sensors.position",
        ),
        ("[valve\n", "not valid TOML"),
        ('[node]\nid = 3\neds = "x"', "node: is a list of tables: write [[node]], in double"),
        (
            '[friction]\nstribeck_friction = { stribeck_velocity = "1 cm/s" }',
            'stribeck_friction.excess: missing; the whole actuator needs excess = "100 N" (break',
        ),
        ('valve = "wide"', "'wide' is not a table"),
        ('[friction]\ncoulomb_friction = { froce = "1 N" }', 'did you mean "force"?'),
        ('[model]\neffects = ["nowhere.py"]', "model.effects"),
        ('[supply]\npressure = "inf bar"', '"inf bar" is outside the allowed'),
        ("[rig]\nseed = " + "9" * 5000, "cannot be read: Exceeds the limit"),
        ("[rig]\nseed = " + "[" * 3000 + "]" * 3000, "nested more than 16 levels deep"),
        ("a." * 3000 + "b = 1", "nested more than 16 levels deep"),
    ],
)
def test_a_mistake_is_named_with_its_remedy(layer: Layer, text: str, message: str) -> None:
    """The message names the mistake, its place and the remedy."""
    assert message in "\n".join(mistakes(REFERENCE, layer(text)))


def test_missing_tables_and_files_are_named(layer: Layer, tmp_path: Path) -> None:
    """A missing file and a configuration without an actuator end with a message."""
    assert "no such file" in mistakes(tmp_path / "missing.toml")[0]
    lines = "\n".join(mistakes(layer('[[node]]\nid = 1\neds = "x.eds"')))
    for table in ("valve", "cylinder", "oil", "load", "supply"):
        assert f"{table}: missing" in lines


def test_all_missing_tables_are_reported_at_once(layer: Layer, tmp_path: Path) -> None:
    """The lines of the message are TOML that loads once they are written, except for the EDS."""
    empty = layer("")
    with pytest.raises(UserError) as caught:
        load([empty], on_bus=True)
    lines = str(caught.value).splitlines()[1:]
    asked = layer("\n".join(line for line in lines if line.startswith("    ")))
    assert len([line for line in lines if not line.startswith("    ")]) == 6
    plant = load([asked], on_bus=True).plant
    assert plant["cylinder_piston_area"] == pytest.approx(math.pi * 0.016**2 / 4)
    assert plant["supply_pressure"] == 160e5


def test_missing_keys_and_missing_tables_are_reported_together(layer: Layer) -> None:
    """The message names a missing key of a table and its missing areas together."""
    lines = "\n".join(mistakes(REFERENCE, layer("[bench]"), layer('[cylinder]\nbore = "1 cm"')))
    assert "give either bore and rod, or piston_area and area_ratio; found bore" in lines
    alone = "\n".join(mistakes(layer('[cylinder]\nbore = "1 cm"\n[valve]\nnatural_frequency = 3')))
    assert 'cylinder.stroke: missing; the whole actuator needs stroke = "80 mm"' in alone
    assert "cylinder: give either bore and rod" in alone
    assert "valve: give either gain, or" in alone
    assert (
        'valve.natural_frequency: 3 has no unit; write it as text with a unit, such as "250'
        in alone
    )


def test_every_key_requests_a_unit_of_its_dimension(layer: Layer) -> None:
    """The example for a number without a unit is accepted by the same key."""
    kinds = {"supply.pressure": "bar", "cylinder.stroke": "mm", "load.mass": "kg",
             "rig.tick": "ms", "oil.bulk_modulus": "MPa"}  # fmt: skip
    for key, unit in kinds.items():
        (line,) = mistakes(REFERENCE, layer(f"{key} = 7"))
        value = re.search(r'such as "([^"]* (\S+))"', line)
        assert value is not None
        assert value[2] == unit
        load([REFERENCE, layer(f'{key} = "{value[1]}"')])


def test_an_effect_of_a_users_file_joins_the_catalogue(layer: Layer, tmp_path: Path) -> None:
    """A Python file with one decorated function is enough to set its knob like any other."""
    (tmp_path / "mine.py").write_text(
        "from hil_emulator.model.declare import Param, effect\n"
        "from hil_emulator.model.stages import friction\n"
        "@effect(friction, knob=Param('strength', 'N*s^2/m^2', 'm', 50.0, 0.0, 1e4),\n"
        "        source='assumed', signature='high speed')\n"
        "def quadratic(velocity, strength):\n"
        "    '''F = C v |v|.'''\n"
        "    return strength * velocity * abs(velocity)\n"
        "EFFECTS = (quadratic,)\n"
    )
    over = layer('[model]\neffects = ["mine.py"]\n[friction]\nquadratic = "80 N*s^2/m^2"')
    config = load([REFERENCE, over])
    assert config.effects[-1].name == "quadratic"
    assert config.plant["quadratic_strength"] == 80.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("raise RuntimeError('out of oil')", "RuntimeError: out of oil"),
        ("1 / 0", "ZeroDivisionError"),
        ("import sys; sys.exit(0)", "SystemExit: 0"),
        ("EFFECTS = 5", "TypeError: 'int' object is not iterable"),
        ("EFFECTS = (5,)", "TypeError: 5 in EFFECTS is no effect"),
        ("", "AttributeError"),
    ],
)
def test_an_effect_file_that_fails_is_one_message(
    layer: Layer, tmp_path: Path, content: str, message: str
) -> None:
    """The message names the file, the reason and the expected content for any exception."""
    (tmp_path / "mine.py").write_text(content)
    (line,) = mistakes(REFERENCE, layer('[model]\neffects = ["mine.py"]'))
    assert f"mine.py: {message}" in line
    assert "lists them in EFFECTS" in line


def test_a_value_on_its_bound_is_allowed(layer: Layer) -> None:
    """100 us are 9.999999999999999e-5 s after the conversion; the bound is 1e-4 s."""
    assert load([REFERENCE, layer('[rig]\ntick = "100 us"')]).tick_ns == 100_000


def test_the_bus_table_is_passed_to_python_can_unchanged(layer: Layer) -> None:
    """The table [bus] is kept as it is; without one, the TCP server on 127.0.0.1 is used."""
    text = REFERENCE.read_text()
    start, end = text.index("[bus]"), text.index("[[node]]")
    without = layer(text[:start] + text[end:])
    assert load([without]).bus == DEFAULT_BUS
    over = layer('[bus]\ninterface = "kvaser"\nbitrate = 500000')
    assert load([without, over]).bus == {"interface": "kvaser", "bitrate": 500000}


def test_the_digest_changes_with_the_content_only(layer: Layer) -> None:
    """Two equal configurations have one digest; another value has another."""
    copy = layer(REFERENCE.read_text().replace("# HyQ", "# the same"))
    assert load([copy]).digest == load([REFERENCE]).digest
    other = layer('[load]\nmass = "51 kg"')
    assert load([REFERENCE, other]).digest != load([REFERENCE]).digest


def test_a_slope_stands_for_the_weight_along_the_rod(layer: Layer) -> None:
    """F = m g sin(slope); 500 kg at 30 degrees: 2452 N, against extension where it lifts."""
    sloped = layer('[load]\nmass = "500 kg"\nslope = "30 deg"')
    assert load([REFERENCE, sloped]).plant["gravity_force"] == pytest.approx(500 * 9.80665 / 2)
    hanging = layer('[load]\nslope = "-90 deg"')
    assert load([REFERENCE, hanging]).plant["gravity_force"] == pytest.approx(-50 * 9.80665)


def test_a_slope_displaces_the_weight_of_an_earlier_file(layer: Layer) -> None:
    """A weight replaces a slope too; both in one file contradict each other."""
    weight, slope = layer('[load]\ngravity = "100 N"'), layer('[load]\nslope = "10 deg"')
    assert load([REFERENCE, slope, weight]).plant["gravity_force"] == pytest.approx(100.0)
    tilted = load([REFERENCE, weight, slope]).plant["gravity_force"]
    assert tilted == pytest.approx(50 * 9.80665 * math.sin(math.radians(10)))
    both = layer('[load]\ngravity = "100 N"\nslope = "10 deg"')
    assert "either gravity" in mistakes(REFERENCE, both)[0]


def test_the_tolerance_of_a_slope_is_that_of_the_weight(layer: Layer) -> None:
    """`identify` fits the weight that follows from it."""
    uncertain = layer('[load]\nslope = { value = "10 deg", tolerance = "20 %" }')
    assert load([REFERENCE, uncertain]).tolerances["gravity_force"] == pytest.approx(0.2)


def test_a_packaged_layer_has_what_the_documents_describe(layer: Layer) -> None:
    """The bandwidth follows the supply pressure, 160 of 210 bar; the film lags; vapour at 0.6."""
    documented = REFERENCE.with_name("hyq_documented.toml")
    before, after = load([REFERENCE]).plant, load([REFERENCE, documented]).plant
    assert before["supply_pressure"] < after["pilot_supply_rated_pressure"]
    added = after.keys() - before.keys()
    assert {"film_lag_strength", "cavitation_floor_pressure_floor", "pilot_supply_share",
            "friction_asymmetry_asymmetry", "position_friction_rise"} <= added  # fmt: skip
    assert before.items() <= after.items()
