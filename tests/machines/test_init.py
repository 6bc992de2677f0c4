"""`hil-emulator init`: from an empty folder to a running machine with the stated values."""

import math
import re
import struct
from pathlib import Path

import can
import canopen
import pytest
from written import init

from hil_emulator.commands.check import warnings
from hil_emulator.config.load import load_rig
from hil_emulator.machines.questions import QUESTIONS
from hil_emulator.simulation.emulator import Emulator


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the usual machine."""
    file, result = init(tmp_path_factory.mktemp("usual"))
    assert result.exit_code == 0, result.output
    return file


def test_what_is_written_loads_and_is_stable(machine: Path) -> None:
    """No warning, every number with a reason, and the schema in the same folder."""
    config = load_rig([machine])
    assert list(warnings(config)) == []
    text = machine.read_text()
    assert text.startswith("#:schema ./hil-emulator.schema.json\n")
    assert machine.with_name("hil-emulator.schema.json").is_file()
    sections = re.split(r"\n(?=\[)", text)
    for section in sections:
        if section.startswith(("[valve]", "[cylinder]", "[friction]", "[load]", "[oil]")):
            for line in filter(None, section.splitlines()[1:]):
                assert "# " in line, line


def test_it_moves_as_its_data_sheets_say(machine: Path) -> None:
    """Full current from the bus: the speed is flow over area, q² (1 + alpha³) = q_n² dp/dp_n1.

    Friction is worth some bar of the supply pressure; the rest of the machine is as written.
    """
    with Emulator(load_rig([machine])) as emulator, can.Bus(**emulator.bus) as bus:
        network = canopen.Network(bus)
        node = network.add_node(5, str(machine.with_suffix(".eds")))
        emulator.tick()  # a node hears nothing before it has booted
        bus.send(can.Message(arbitration_id=0, data=[1, 5], is_extended_id=False))
        full = struct.pack("<i", 10_000_000)
        emulator.every_tick(
            lambda: bus.send(can.Message(arbitration_id=0x205, data=full, is_extended_id=False))
        )
        emulator.run_for("80 ms")
        alpha, area = 1 - 0.7**2, math.pi * 0.04**2 / 4
        velocity = emulator.signals.model.velocity
        lost = emulator.signals.model.friction_force / area
        drop = 210e5 - lost - alpha * 1e5
        flow = 40e-3 / 60 * math.sqrt(drop / (1 + alpha**3) / 35e5)
        assert velocity == pytest.approx(flow / area, rel=0.03)
        emulator.run_for("920 ms")
        assert emulator.signals.model.position == pytest.approx(0.3, abs=2e-3)
        assert emulator.signals.pressure_a == pytest.approx(210e5, rel=0.02)
        assert node.object_dictionary["valve_current"].max == 10_000_000


def test_closed_it_rings_at_the_frequency_of_mass_on_oil(machine: Path) -> None:
    """K = E (A_a²/V_a + A_b²/V_b): a blow on the load, the valve centred."""
    config = load_rig([machine])
    plant = config.plant
    area, stroke = plant["cylinder_piston_area"], plant["cylinder_stroke"]
    stiffness = sum(
        1.3e9 * a**2 / (plant[f"cylinder_dead_volume_{side}"] + a * stroke / 2)
        for side, a in (("a", area), ("b", area * plant["cylinder_area_ratio"]))
    )
    expected = math.sqrt(stiffness / (100.0 + plant["rod_mass_mass"])) / (2 * math.pi)
    output = init(machine.parent, "--overwrite")[1].output
    frequency = re.search(r"natural frequency ([\d.]+) Hz", output)
    assert frequency is not None
    assert float(frequency[1]) == pytest.approx(expected, rel=5e-3)


@pytest.mark.slow
def test_larger_valves_and_pressures_have_an_eds_that_carries_them(tmp_path: Path) -> None:
    """40 mA can be commanded, 300 bar in an annulus be shown, and a force of meganewtons."""
    file, result = init(
        tmp_path, "--valve", "moog_g761_38", "--supply-pressure", "300 bar", "--bore", "400 mm",
        "--line-length", "2 m", "--mass", "2 t",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    sheet = canopen.import_od(str(file.with_suffix(".eds")))
    assert sheet["valve_current"].max == 40_000_000
    assert sheet["valve_current"].min == -40_000_000
    text = file.with_suffix(".eds").read_text()
    digits = {index: float(re.search(rf"\[{index}\]\n(?:.+\n)*?Factor=(\S+)", text)[1])
              for index in ("2010", "2011", "2012", "2030")}  # fmt: skip
    assert digits["2010"] == digits["2011"] == digits["2012"]
    assert digits["2010"] * 32767 > 1.3 * 300e5
    assert digits["2030"] * (2**31 - 1) > 300e5 * math.pi * 0.2**2


@pytest.mark.slow
def test_a_solenoid_of_more_amperes_than_nanoamperes_carry_has_coarser_digits(
    tmp_path: Path,
) -> None:
    """2.5 A do not fit into 31 bits of nA; the limit is the rated current in the digits written."""
    file, result = init(tmp_path, "--valve", "atos_dhzo_a_071_28")
    assert result.exit_code == 0, result.output
    text = file.with_suffix(".eds").read_text()
    section = text.split("[2000]")[1].split("[2001]")[0]
    (digit,) = re.findall(r"Factor=(\S+)", section)
    limit = canopen.import_od(str(file.with_suffix(".eds")))["valve_current"].max
    assert limit * float(digit) == pytest.approx(2.5)
    assert load_rig([file]).plant["overlap_lap"] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--bore", "40"], '--bore: "40" is a plain number; a length is wanted, such as'),
        (["--bore", "40 bar"], '--bore: "40 bar" is a pressure; a length is wanted'),
        (["--rod", "50 mm"], "--rod: the rod must be thinner than the bore, 40 mm"),
        (["--valve", "moog"], "--valve: there is no 'moog'; there are moog_e024,"),
        (["--supply-pressure", "360 bar"], "takes at most 350 bar; choose another valve, or less"),
        (["--pump", "petrol"], "--pump: there is no 'petrol'; there are ideal, fixed, variable"),
        (["--pump-flow", "9 l/min"], "--pump-flow: does not apply here, see --pump"),
        (["--pump", "fixed", "--precharge", "9 bar"], "see --pump and --accumulator"),
        (["--pump", "fixed", "--accumulator", "1 l", "--precharge", "250 bar"], "is below the su"),
        (["--weight", "40 kN"], "lifts no more than 26.3894 kN; take a larger bore"),
        (["--hysteresis", "30 %"], '--hysteresis: "30 %" is outside the allowed 0 % ... 10 %'),
        (["--node-id", "128"], '--node-id: "128" is outside the allowed 1 ... 127'),
    ],
)
def test_a_wrong_answer_is_refused_with_the_way_out(
    tmp_path: Path, options: list[str], message: str
) -> None:
    """The option, the reason, what would do; and nothing is written."""
    file, result = init(tmp_path, *options)
    assert result.exit_code == 2
    assert message in result.output
    assert not file.exists()


@pytest.mark.slow
def test_every_prompt_may_be_answered_wrongly_once(tmp_path: Path) -> None:
    """A wrong answer is reported and the prompt repeated; Enter accepts the default."""
    wrong = {
        "bore": "4", "rod": "5 cm", "stroke": "3 s", "valve": "none", "supply_pressure": "1 kbar",
        "tank_pressure": "-1 bar", "pump": "hand", "pump_flow": "1 l", "accumulator": "1 bar",
        "precharge": "220 bar", "line_length": "-1 m", "mass": "1 N", "weight": "1 MN",
        "node_id": "0",
    }  # fmt: skip
    right = {"pump": "variable", "accumulator": "1 l"}
    asked = [q.name for q in QUESTIONS if q.name == "name" or q.name in wrong]
    lines = [line for n in asked for line in (wrong.get(n), right.get(n, "")) if line is not None]
    file, result = init(tmp_path, answers="\n".join(lines) + "\n")
    assert result.exit_code == 0, result.output
    messages = re.findall(r"(?m)^  (\S.*)", result.output)
    assert len(messages) == len(wrong)
    assert 'accumulator = { gas_volume = "1 l", precharge = "168 bar" }' in file.read_text()


def test_nothing_is_written_over(tmp_path: Path) -> None:
    """An existing file is not changed without `--overwrite`; other endings are refused."""
    (tmp_path / "machine.eds").write_text("mine")
    file, result = init(tmp_path)
    assert result.exit_code == 2
    assert "machine.eds: exists already; choose another name, or add --overwrite" in result.output
    assert (tmp_path / "machine.eds").read_text() == "mine"
    assert not file.exists()


def test_a_name_cannot_become_a_line(tmp_path: Path) -> None:
    """Whatever the name is, the file stays what it is."""
    file, result = init(tmp_path, "--name", 'x\n[valve]\ngain = "1"')
    assert result.exit_code == 0, result.output
    assert '# x [valve] gain = "1"\n' in file.read_text()
