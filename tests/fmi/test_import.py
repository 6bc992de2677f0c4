"""An FMU behind the CANopen nodes: a foreign one, faulty ones, and the exported one."""

import math
import struct
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner

from hil_emulator.__main__ import main
from hil_emulator.bus.bus import Bus
from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.frame import Frame
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator

pytest.importorskip("fmpy")

KNEE = shipped("configs/hyq_knee.toml")
HERE = Path(__file__).parent
FULL = pytest.mark.full(sibling="test_an_fmu_that_fails_does_not_take_the_bus_down")

WIRED = """
[plant]
fmu = "crane.fmu"
timeout = "500 ms"

[plant.inputs]
valve_current = "motor.i"

[plant.outputs]
position = "x[1]"
load_force = "motor.F [kN]"

[plant.parameters]
m = 50.0
misdeed = {misdeed}
"""

QUIET = """
[sensors.position]
resolution = "off"
[sensors.load_force]
resolution = "off"
noise = "off"
"""


@contextmanager
def emulator(crane: Path, text: str) -> Iterator[Emulator]:
    """Run the reference machine with a layer on top, in lock-step."""
    layer = crane.parent / "layer.toml"
    layer.write_text(text)
    with Emulator(load([KNEE, layer])) as made:
        yield made


def frames(made: Emulator, ticks: int, current: float = 5e-3) -> list[Frame]:
    """Command a valve current [A] for some ticks, and return what the node has sent."""
    with Bus(made.bus) as peer:
        made.tick()
        peer.send([Frame(0x000, bytes([1, 5]))])
        heard: list[Frame] = []
        for _ in range(ticks):
            peer.send([Frame(0x205, struct.pack("<i", round(current * 1e9)))])
            made.tick()
            heard += peer.receive()
        return heard


def test_a_foreign_plant_moves_behind_the_node(crane: Path) -> None:
    """Units are converted both ways: 5 mA are 0.5 kN in the end, F = F_0 (1 - exp(-t/10 ms))."""
    with emulator(crane, WIRED.format(misdeed=0) + QUIET) as made:
        sent = frames(made, 50)
        force = made.signals.load_force
        assert force == pytest.approx(500.0 * (1.0 - math.exp(-50e-3 / 10e-3)), rel=1e-12)
        assert made.signals.position == made.signals.model.position
        # a force that rises to F_0 with T moves 50 kg by F_0/m (t²/2 - T t + T² (1 - e^(-t/T)))
        t, lag = 50e-3, 10e-3
        way = 10.0 * (t * t / 2 - lag * t + lag * lag * (1.0 - math.exp(-t / lag)))
        assert made.signals.position == pytest.approx(way, rel=1e-2)
        last = [f for f in sent if f.can_id == 0x385][-1]
        assert struct.unpack_from("<i", last.data)[0] == round(force * 1e3)


def test_functions_around_the_plant_work_as_with_the_built_in_one(crane: Path) -> None:
    """These are faults of sensors and bus, conditions and a recording."""
    with emulator(crane, WIRED.format(misdeed=0)) as made:
        frames(made, 20)
        with made.fault("position", "offset", value="1 mm"):
            made.tick()
            apart = made.signals.position - made.signals.model.position
            assert apart == pytest.approx(1e-3, abs=4e-6)
        made.wait_until("model.load_force < 100 N", within="100 ms")
        assert made.recording().table()["model.position"][-1] == made.signals.model.position


@pytest.mark.parametrize(
    ("misdeed", "message"),
    [
        (2, "has crashed: signal 11"), (5, "has not answered for 0.5 s"),
        pytest.param(3, "its step from 0.05 s failed", marks=FULL),
        pytest.param(4, "its step from 0.05 s discarded", marks=FULL),
        pytest.param(6, "has ended with exit code 7", marks=FULL),
        pytest.param(7, "has an output that is no finite number", marks=FULL),
    ],
)  # fmt: skip
def test_an_fmu_that_fails_does_not_take_the_bus_down(
    crane: Path, misdeed: int, message: str
) -> None:
    """The node sends one emergency 0x6100 and no plausible reading, and still responds."""
    with emulator(crane, WIRED.format(misdeed=misdeed)) as made:
        sent = frames(made, 80)
        assert message in made.rig.plant.supply.failure
        assert [f.data[:2] for f in sent if f.can_id == 0x085 and f.data[:2] != bytes(2)] == [
            b"\x00\x61"
        ]
        last = [f for f in sent if f.can_id == 0x385][-1]
        assert struct.unpack_from("<i", last.data)[0] == -(2**31)
        assert sum(f.can_id == 0x385 for f in sent) > 75


def test_a_run_whose_fmu_fails_goes_on_and_ends_with_a_clear_line(crane: Path) -> None:
    """It runs to its end, with the FMU's failure as the last line and exit code 1."""
    layer = crane.parent / "layer.toml"
    layer.write_text(WIRED.format(misdeed=2))
    words = ["--bus", "virtual:crash", "--clock", "lockstep", "--duration", "100 ms"]
    done = CliRunner().invoke(main, ["run", str(KNEE), str(layer), *words])
    assert done.exit_code == 1
    assert "plant     " in done.output
    assert done.output.strip().splitlines()[-1].endswith("crane.fmu has crashed: signal 11")
    assert "frames    0 in, 2 out" in done.output  # boot-up and emergency


def test_the_exported_fmu_gives_the_frames_of_the_built_in_plant(knee_fmu: Path) -> None:
    """The exported FMU, imported again, leads to the same frames byte for byte."""
    names = [*(c.signal for c in CHANNELS), "transverse_force"]
    wired = "\n".join(f'{name} = "model.{name}"' for name in names)
    text = f"""
[plant]
fmu = "{knee_fmu.name}"
[plant.inputs]
valve_current = "valve_current"
external_force = "external_force"
[plant.outputs]
{wired}
"""
    with emulator(knee_fmu, text) as imported, emulator(knee_fmu, "") as built_in:
        for made in (imported, built_in):
            made.set("external_force", "200 N")
        assert frames(imported, 200) == frames(built_in, 200)
        assert built_in.signals.model.position > 0.04


def test_only_the_built_in_plant_has_parameters_to_break(crane: Path) -> None:
    """A fault or setting of the plant is refused, and so is a command that needs the model."""
    with emulator(crane, WIRED.format(misdeed=0)) as made:
        with pytest.raises(UserError, match="in place of the built-in plant"):
            made.fault("supply", "droop", drop="60 bar")
        with pytest.raises(UserError, match="in place of the built-in plant"):
            made.set("supply_pressure", "100 bar")
    done = CliRunner().invoke(main, ["linear", str(KNEE), str(crane.parent / "layer.toml")])
    assert done.exit_code == 2
    assert "leave the file with [plant] fmu out" in done.output


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("x[1]", "x[2]"), "no variable 'x\\[2\\]'; of kind output there are motor.F"),
        (("motor.i", "motor.F"), "'motor.F' is of kind output, wanted is input"),
        (("[kN]", "[kg]"), "'motor.F' is in 'kg', wanted is a unit like N"),
        (("position =", "place ="), "place: unknown"),
        (("crane.fmu", "cranes.fmu"), "there is no such FMU"),
        (("crane.fmu", "layer.toml"), "is no FMU"),
        (("misdeed = 0", "misdeed = 1"), "nitializ"),
        (('fmu = "crane.fmu"', ""), "without naming it"),
    ],
)
def test_a_wrong_wiring_is_reported_before_the_first_frame(
    crane: Path, change: tuple[str, str], message: str
) -> None:
    """One message that names the file, what is wrong and what there is."""
    text = WIRED.format(misdeed=0)
    assert change[0] in text
    with pytest.raises(UserError, match=message), emulator(crane, text.replace(*change)):
        pass


def test_an_fmu_for_another_system_is_refused(crane: Path) -> None:
    """The message names the systems that it is for."""
    other = crane.with_name("other.fmu")
    with zipfile.ZipFile(crane) as given, zipfile.ZipFile(other, "w") as archive:
        archive.writestr("modelDescription.xml", given.read("modelDescription.xml"))
        archive.writestr("binaries/win32/crane.dll", b"")
    text = WIRED.format(misdeed=0).replace("crane.fmu", "other.fmu")
    with pytest.raises(UserError, match="is for win32"), emulator(crane, text):
        pass


def test_a_valve_driver_by_cia_408_stands_in_front_of_it(crane: Path) -> None:
    """In ACTIVE, a quarter of full scale is a quarter of 10 mA, that is 250 N in the end."""
    layer = crane.parent / "layer.toml"
    layer.write_text(WIRED.format(misdeed=0))
    separate = KNEE.with_name("hyq_knee_separate.toml")
    with Emulator(load([KNEE, separate, layer])) as made, Bus(made.bus) as peer:
        made.tick()
        peer.send([Frame(0x000, bytes([1, 0]))])
        for word in (0x08, 0x09, 0x0B, *[0x0F] * 200):
            peer.send([Frame(0x205, struct.pack("<Hh", word, 0x4000 // 4))])
            made.tick()
        assert made.signals.model.load_force == pytest.approx(250.0, rel=1e-6)
        sent = [f for f in peer.receive() if f.can_id == 0x188]
        assert sent
