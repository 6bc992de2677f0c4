"""A CiA 401 I/O module with wired sensors and a wired valve, read by a stock master."""

import struct
from collections.abc import Iterator
from pathlib import Path

import cantools
import pytest
from foreign_nodes import Plant, plant

from hil_emulator.captures.by_dictionary import carriers
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.message import message
from hil_emulator.errors import UserError
from hil_emulator.export.can_database import dbc
from hil_emulator.export.electronic_data_sheet import eds
from hil_emulator.units import count, multiple

MODULE = """
[[node]]
id = 9
eds = "module.eds"
autostart = true
commands = ["valve_current"]
[node.map]
"0x6401:2" = { channel = "position", points = { "0" = "0 mm", "27648" = "80 mm" } }
"0x6401:3" = { channel = "spool_position", points = VOLTS, digits = "mV" }
"0x6401:4" = { channel = "supply_pressure", unit = "bar" }
"0x6411:1" = { command = "valve_current", points = PERCENT, digits = "0.01 %" }
"0x6200:1" = { command = "valve_enable", bit = 2 }
"0x2200" = { command = "valve_ramp_time", unit = "ms" }

[node.map."0x6401:1"]
channel = "pressure_a"
points = { "4 mA" = "0 bar", "20 mA" = "250 bar" }
digits = "1 uA"
range = ["0 mA", "21 mA"]
""".replace("VOLTS", '{ "-10 V" = "-10 mA", "10 V" = "10 mA" }').replace(
    "PERCENT", '{ "-100 %" = "-10 mA", "100 %" = "10 mA" }'
)


def object_text(index: str, name: str, kind: int, access: str, members: int = 0) -> str:
    """Return the section of a variable or an array of an EDS."""
    shape = f"ObjectType=0x8\nCompactSubObj={members}" if members else "ObjectType=0x7"
    return (
        f"[{index}]\nParameterName={name}\n{shape}\nDataType=0x{kind:04X}\n"
        f"AccessType={access}\nPDOMapping=1\n"
    )


def module_text() -> str:
    """Return the EDS of an I/O module: four analogue inputs, an output, eight digital outputs."""
    pdo = (
        "[{0}]\nParameterName=PDO\nObjectType=0x9\nSubNumber={1}\n"
        "[{0}sub0]\nParameterName=Entries\nDataType=5\nAccessType=const\nDefaultValue={2}\n"
    )
    member = "[{}sub{}]\nParameterName=Entry {}\nDataType={}\nAccessType=rw\nDefaultValue={}\n"
    parts = [
        "[FileInfo]\nFileName=module.eds\n[DeviceInfo]\nNrOfRXPDO=1\nNrOfTXPDO=1\n",
        "[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x000F0191\n",
        "[1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n",
        pdo.format("1400", 3, 2), member.format("1400", 1, 1, 7, "$NODEID+0x200"),
        member.format("1400", 2, 2, 5, 255),
        pdo.format("1600", 3, 2), member.format("1600", 1, 1, 7, "0x64110110"),
        member.format("1600", 2, 2, 7, "0x62000108"),
        pdo.format("1800", 4, 5), member.format("1800", 1, 1, 7, "$NODEID+0x40000180"),
        member.format("1800", 2, 2, 5, 255), member.format("1800", 5, 5, 6, 1),
        pdo.format("1A00", 5, 4),
        *(member.format("1A00", n, n, 7, f"0x64010{n}10") for n in range(1, 5)),
        object_text("2200", "Ramp time", 6, "rw"),
        object_text("6200", "Digital outputs", 5, "rww", 1),
        object_text("6401", "Analogue inputs", 3, "ro", 4),
        object_text("6411", "Analogue outputs", 3, "rww", 1),
    ]  # fmt: skip
    return "".join(parts)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Plant]:
    """Yield the reference machine with an I/O module as its only node that commands."""
    with module_rig(tmp_path, MODULE) as made:
        yield made


def module_rig(folder: Path, text: str):  # type: ignore[no-untyped-def]
    """Return the rig of a text; its combined node only measures."""
    (folder / "module.eds").write_text(module_text())
    return plant(folder, "commands = []\n" + text)


def inputs(rig: Plant) -> tuple[int, ...]:
    """Return the four analogue inputs as the last frame of the module shows them."""
    return struct.unpack("<4h", rig.data(0x189)[-1])


def command(rig: Plant, percent: float, outputs: int) -> None:
    """Send set point and digital outputs."""
    rig.network.send_message(0x209, struct.pack("<hB", round(100 * percent), outputs))


def test_a_live_zero_is_shown_in_microampere(rig: Plant) -> None:
    """4 to 20 mA are 0 to 250 bar; raw digits, ±10 V and `unit = "bar"` likewise."""
    rig.emulator.run_for("20 ms")
    signals = rig.emulator.signals
    pressure, position, spool, supply = inputs(rig)
    assert pressure == pytest.approx(4000 + 16000 * signals.pressure_a / 250e5, abs=1)
    assert position == pytest.approx(27648 * signals.position / 0.08, abs=1)
    assert spool == pytest.approx(1e6 * signals.spool_position, abs=1)
    assert supply == pytest.approx(signals.supply_pressure / 1e5, abs=0.51)


def test_a_broken_wire_is_below_the_live_zero(rig: Plant) -> None:
    """The input shows 0 mA during the fault, the pressure afterwards (NAMUR NE 43: < 3.6 mA)."""
    rig.emulator.run_for("5 ms")
    sound = inputs(rig)[0]
    with rig.emulator.fault("pressure_a", "wire_break"):
        rig.emulator.run_for("5 ms")
        assert inputs(rig)[0] == 0
        assert rig.emulator.signals.pressure_a == pytest.approx(-62.5e5)
    rig.emulator.run_for("5 ms")
    assert inputs(rig)[0] == pytest.approx(sound, abs=20)


def test_an_input_saturates_where_the_module_does(rig: Plant) -> None:
    """It saturates at 21 mA, although 16 bits can represent more."""
    rig.emulator.run_for("5 ms")
    with rig.emulator.fault("pressure_a", "offset", value="300 bar"):
        rig.emulator.run_for("5 ms")
        assert inputs(rig)[0] == 21_000


def test_the_valve_moves_only_while_it_is_enabled(rig: Plant) -> None:
    """Only bit 2 enables; without it the current is 0 at once."""
    current = rig.emulator.rig.plant.inputs
    for outputs, expected in ((0, 0.0), (3, 0.0), (4, 5e-3), (0xFF, 5e-3), (0xFB, 0.0)):
        command(rig, 50.0, outputs)
        rig.emulator.run_for("3 ms")
        assert float(current.valve_current) == pytest.approx(expected), outputs


def test_set_points_end_at_100_percent(rig: Plant) -> None:
    """A set point of 120 % is limited to the end of the scale, 100 %."""
    command(rig, 120.0, 4)
    rig.emulator.run_for("3 ms")
    assert float(rig.emulator.rig.plant.inputs.valve_current) == pytest.approx(10e-3)


def test_a_ramp_takes_its_time_for_the_full_scale(rig: Plant) -> None:
    """100 ms from 0 to 100 %: 40 % after 40 ms, -10 % another 50 ms later, 0 when disabled."""
    rig.master(9).sdo[0x2200].raw = 100
    command(rig, 100.0, 4)
    rig.emulator.run_for("40 ms")
    current = rig.emulator.rig.plant.inputs
    assert float(current.valve_current) == pytest.approx(4e-3, abs=0.11e-3)
    command(rig, -100.0, 4)
    rig.emulator.run_for("50 ms")
    assert float(current.valve_current) == pytest.approx(-1e-3, abs=0.21e-3)
    command(rig, -100.0, 0)
    rig.emulator.run_for("2 ms")
    assert float(current.valve_current) == 0.0


def test_without_operational_the_valve_is_closed(rig: Plant) -> None:
    """The enable acts in OPERATIONAL only."""
    command(rig, 50.0, 4)
    rig.emulator.run_for("3 ms")
    rig.network.nmt.send_command(128)
    rig.emulator.run_for("3 ms")
    assert float(rig.emulator.rig.plant.inputs.valve_current) == 0.0


def test_exported_files_have_the_live_zero(rig: Plant) -> None:
    """The DBC decodes 12 mA to 125 bar, and the EDS has the same scale."""
    node = rig.emulator.rig.nodes[1]
    pdos = [message("module", pdo) for pdo in node.pdos if pdo.active]
    database = cantools.database.load_string(dbc(pdos, 0), "dbc")
    decoded = database.decode_message(0x189, struct.pack("<4h", 12_000, 13_824, -5_000, 160))
    assert decoded == pytest.approx(
        {"Analogue_inputs1": 125e5, "Analogue_inputs2": 0.04, "Analogue_inputs3": -5e-3,
         "Analogue_inputs4": 160e5}
    )  # fmt: skip
    (carrier,) = [c for c in carriers(node.dictionary, node.pdos) if c.can_id == 0x189]
    values = carrier.decode(struct.pack("<4h", 12_000, 0, 0, 0))
    assert values["pressure_a"] == pytest.approx(125e5)


def test_a_scale_with_an_offset_survives_in_an_eds(tmp_path: Path) -> None:
    """`Offset` is in [Comments], like Unit and Factor."""
    file = tmp_path / "module.eds"
    pressure = "ParameterName=Pressure\nDataType=3\nAccessType=ro\nPDOMapping=1"
    comments = (
        "[Comments]\nLines=1\nLine1=2300: Signal=pressure_a Unit=Pa Factor=1562.5 Offset=-62.5e5"
    )
    file.write_text(f"{module_text()}[2300]\n{pressure}\n{comments}\n")
    exported = tmp_path / "exported.eds"
    exported.write_text(eds(Dictionary.from_eds(file, 9), "exported.eds"))
    for entry in (Dictionary.from_eds(f, 9).entry(0x2300) for f in (file, exported)):
        assert entry.physical(12_000) == pytest.approx(125e5)
        assert entry.digits(125e5) == 12_000


PRESSURE = '{ channel = "pressure_a", '


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PRESSURE + 'points = { "4 mA" = "0 bar" }, digits = "1 uA" }', "points are two"),
        (PRESSURE + 'points = { "4 mA" = "0 bar", "4 mA " = "1 bar" }, digits = "uA" }', "same"),
        (PRESSURE + 'points = { "4 mA" = "0 bar", "20 mA" = "9 mm" }, digits = "uA" }', "pressure"),
        (PRESSURE + 'points = { "4 mA" = "0 bar", "20 mA" = "9 bar" } }', "is a number of digits"),
        (PRESSURE + 'points = { "4" = "0 bar", "20" = "9 bar" }, unit = "bar" }', "keep one"),
        (PRESSURE + 'unit = "bar", range = [3, 2] }', "the first end is the lower one"),
        (PRESSURE + 'unit = "bar", range = [0, 40000] }', "does not hold 0 to 40000 digits"),
        (PRESSURE + 'unit = "bar", bit = 1 }', "unknown key 'bit'"),
        (PRESSURE + 'unit = "bar", range = [0, inf] }', "inf is not finite"),
        (PRESSURE + 'unit = "bar", range = ["0", []] }', "is a number of digits"),
        (PRESSURE + 'points = { "0" = "0 bar", "9" = "inf bar" } }', "points are finite"),
        (PRESSURE + 'digits = "1 uA" }', "digits belongs to points"),
        (PRESSURE + 'unit = "0 bar" }', "a finite quantity, not 0"),
        ('{ command = "valve_enable", bit = 32 }', "a bit of valve_enable, 0 to 31"),
        ('{ command = "valve_enable", bit = 16 }', "a INTEGER16 has no bit 16"),
        ('{ command = "valve_enable", bit = 1 }', "act on valve_current of the same node"),
    ],
)
def test_a_wrong_scale_is_refused_with_its_place(tmp_path: Path, text: str, message: str) -> None:
    """The message names the key and a correct form."""
    node = f'[[node]]\nid = 9\neds = "module.eds"\nmap = {{ "0x6401:1" = {text} }}\n'
    with pytest.raises(UserError) as refusal, module_rig(tmp_path, node):
        pass
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "unit", "factor", "offset"),
    [
        ("bar", "Pa", 1e5, 0.0),
        ("0.1 mbar", "Pa", 10.0, 0.0),
        ("0.1 bar(g)", "Pa", 1e4, 101325.0),
        ("psig", "Pa", 6894.757, 101325.0),
        ("-2 um", "m", -2e-6, 0.0),
        ("%", "1", 0.01, 0.0),
    ],
)
def test_a_unit_without_a_number_is_one_unit(
    text: str, unit: str, factor: float, offset: float
) -> None:
    """A unit without a number counts as 1; gauge pressures are relative to the atmosphere."""
    assert multiple(text, unit) == (pytest.approx(factor), offset)


def test_quantities_are_converted_to_digits(tmp_path: Path) -> None:
    """Usual units are converted without pint, temperatures with their zero."""
    assert count("4 mA", "uA") == pytest.approx(4000.0)
    assert count("20 °C", "0.1 K") == pytest.approx(2931.5)
