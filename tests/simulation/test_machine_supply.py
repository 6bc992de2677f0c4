"""A machine whose actuators share a supply: settings, faults, recordings and refusals."""

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from rigs import START, set_point

from hil_emulator.api.logs import Meaning, experiments
from hil_emulator.bus.bus import Bus
from hil_emulator.commands.replay import replay
from hil_emulator.config.load import load
from hil_emulator.config.machine import load_machine
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import cache_folder, shipped
from hil_emulator.recording.header import header
from hil_emulator.recording.recorder import FileRecorder
from hil_emulator.simulation.clock import Clock, LockStep, WallClock
from hil_emulator.simulation.loop import Timing, run
from hil_emulator.simulation.machine import Machine, assemble_machine

KNEE = shipped("configs/hyq_knee.toml")
_numbers = itertools.count()

PUMP = """
[supply]
volume = "0.1 l"

[supply.fixed_pump]
flow = "5 l/min"
"""

PAIR = f"""
[buses.hip]
interface = "virtual"
channel = "hip"

[buses.knee]
interface = "virtual"
channel = "knee"

[supplies.pump]
files = ["pump.toml"]

[[actuator]]
name = "hip"
files = ["{KNEE}"]
bus = "hip"
supply = "pump"

[[actuator]]
name = "knee"
files = ["{KNEE}"]
bus = "knee"
supply = "pump"
"""

Write = Callable[..., Path]
Assembled = Callable[[Path], tuple[Machine, dict[str, Bus]]]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes a machine's file and its supply's file."""

    def write(text: str = PAIR, pump: str = PUMP) -> Path:
        (tmp_path / "pump.toml").write_text(pump)
        (tmp_path / "reset.toml").write_text('[rig]\nnot_finite = "reset"')
        file = tmp_path / "machine.toml"
        file.write_text(text)
        return file

    return write


@pytest.fixture
def assembled() -> Iterator[Assembled]:
    """Return a function that creates a machine and a peer on each of its buses."""
    opened: list[Bus] = []

    def assembled(file: Path) -> tuple[Machine, dict[str, Bus]]:
        settings, number = load_machine([file]), next(_numbers)

        def buses() -> dict[str, Bus]:
            channels = {name: f"supply {number} {name}" for name in settings.buses}
            made = {n: Bus({"interface": "virtual", "channel": c}) for n, c in channels.items()}
            opened.extend(made.values())
            return made

        return assemble_machine(settings, buses(), cache_folder()), buses()

    yield assembled
    for bus in opened:
        bus.close()


def pressures(machine: Machine) -> list[float]:
    """Return the supply pressure at every actuator."""
    return [float(rig.plant.signals.supply_pressure) for rig in machine.rigs.values()]


def move(machine: Machine, peers: dict[str, Bus], ticks: int, *names: str) -> list[float]:
    """Open some valves for some ticks; return the final supply pressures."""
    for tick in range(ticks):
        for name, peer in peers.items():
            peer.send([START] if tick < 2 else [set_point(6.0 if name in names else 0.0)])
        machine.step()
    return pressures(machine)


@pytest.mark.slow
def test_the_supply_droops_further_when_both_move(write: Write, assembled: Assembled) -> None:
    """Both actuators read the common pressure, with one or both valves open."""
    lowest = []
    for names in (("hip",), ("hip", "knee")):
        supply = move(*assembled(write()), 50, *names)
        assert supply[0] == supply[1]
        lowest.append(supply[0])
    assert lowest[1] < lowest[0] - 5e5 < 155e5


@pytest.mark.slow
def test_both_sensors_of_supply_pressure_read_the_shared_one(
    write: Write, assembled: Assembled
) -> None:
    """The sensors have independent noise of 0.1 bar."""
    machine, peers = assembled(write())
    move(machine, peers, 50, "hip")
    (shared, _), read = pressures(machine), []
    for rig in machine.rigs.values():
        read.append(rig.value("supply_pressure"))
    assert read == pytest.approx([shared] * 2, abs=0.5e5)
    assert read[0] != read[1]


@pytest.mark.slow
def test_a_setting_of_one_is_that_of_the_shared_supply(write: Write, assembled: Assembled) -> None:
    """A setting of 120 bar at the knee also applies to the hip."""
    machine, peers = assembled(write())
    machine.rigs["knee"].set("supply_pressure", 120e5)
    assert move(machine, peers, 200) == pytest.approx([120e5] * 2, rel=5e-3)


def test_a_pump_that_fails_for_one_fails_for_all_until_it_ends(
    write: Write, assembled: Assembled
) -> None:
    """The fault begins by a condition of the rig of its injection, and ends for both."""
    machine, peers = assembled(write())
    hip, knee = machine.rigs.values()
    running = knee.fault("supply", "loss", condition="position > 42 mm")
    assert move(machine, peers, 30, "hip")[0] > 80e5
    assert hip.value("model.position") > 0.042 > knee.value("model.position")
    move(machine, peers, 300, "knee")
    assert knee.value("model.position") > 0.042
    assert pressures(machine) == pytest.approx([1e5] * 2, abs=5e5)
    running.end()
    assert not hip.faults.injected
    assert move(machine, peers, 300) == pytest.approx([160e5] * 2, rel=5e-3)


def test_actuators_on_one_supply_restart_together(
    write: Write, assembled: Assembled, caplog: pytest.LogCaptureFixture
) -> None:
    """After the loss of one state all are reset to rest in the same tick, with one pump."""
    machine, peers = assembled(write(PAIR.replace(str(KNEE) + '"', f'{KNEE}", "reset.toml"')))
    move(machine, peers, 50, "hip")
    hip, knee = machine.rigs.values()
    knee.plant.state.pressure_a = np.nan
    machine.step()
    assert "pressure_a" in caplog.records[0].message
    states = [rig.plant.state_vector.tolist() for rig in (hip, knee)]
    assert states[0] == states[1]
    assert move(machine, peers, 10) == pytest.approx([160e5] * 2, rel=5e-3)


def test_every_clock_gives_the_same_bits(write: Write, assembled: Assembled) -> None:
    """Lock-step and a wall clock give equal results: flows are exchanged in each step."""
    states = []
    clocks: tuple[Clock, ...] = (
        LockStep(), WallClock(1_000_000, now=lambda: 0, sleep=lambda seconds: None)
    )  # fmt: skip
    for clock in clocks:
        machine, peers = assembled(write())
        move(machine, peers, 2)
        for tick in range(40):
            peers["hip"].send([set_point(5.0)])
            peers["knee"].send([set_point(8.0 if tick % 20 < 10 else -8.0)])
            run(machine, clock, 1, Timing())
        states.append([rig.plant.state_vector.tolist() for rig in machine.rigs.values()])
    assert states[0] == states[1]


def test_a_recording_names_the_actuators_on_its_supply(
    write: Write, assembled: Assembled, tmp_path: Path
) -> None:
    """Replay refuses the recording; identification accepts it without a pump, with a note."""
    file = write()
    machine, peers = assembled(file)
    knee = load_machine([file]).actuators[1].config
    journal = tmp_path / "knee.rec"
    machine.rigs["knee"].recorder = recorder = FileRecorder([journal], header(knee, []))
    move(machine, peers, 100, "hip", "knee")
    recorder.close()
    with pytest.raises(UserError, match=r"supply shared with hip: their flow is not recorded"):
        replay(journal, [])
    with pytest.raises(UserError, match=r"shared with hip.*leave fixed_pump out"):
        experiments([journal], load([KNEE, tmp_path / "pump.toml"]), Meaning())
    (experiment,) = experiments([journal], load([KNEE]), Meaning())
    assert np.nanmin(experiment.readings["supply_pressure"]) < 150e5
    assert any("supply shared with hip" in note for note in experiment.notes)


@pytest.mark.slow
def test_an_actuator_may_keep_a_separate_supply(write: Write, assembled: Assembled) -> None:
    """The hip's flow does not change the supply of a knee that names no supply."""
    text = PAIR.removesuffix('supply = "pump"\n')
    supply = move(*assembled(write(text)), 50, "hip")
    assert supply[0] < 155e5
    assert supply[1] == 160e5


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('supply = "pump"\n', 'supply = "pomp"\n', "there is no supply 'pomp'; there are: pump"),
        ('supply = "pump"\n', "", "no actuator is on supply pump; write supply ="),
        ('files = ["pump.toml"]', "files = []", "supplies.pump.files"),
        ('files = ["pump.toml"]', 'files = ["missing.toml"]', "no such"),
    ],
)
def test_a_mistake_in_a_supply_is_named(write: Write, old: str, new: str, message: str) -> None:
    """The message has the mistake, its place and the remedy."""
    assert old in PAIR
    with pytest.raises(UserError, match=message):
        load_machine([write(PAIR.replace(old, new))])


@pytest.mark.parametrize(
    ("layer", "message"),
    [
        (
            '[supply]\nsupply_line = "2 m"',
            r"hip and knee differ in supply_line_length: 0 m and 2 m",
        ),
        ('[oil]\ntemperature = "60 degC"', r"differ in oil_temperature: 40 degC and 60 degC"),
        ('[rig]\nstep = "10 us"', r"need the same \[rig\] step"),
    ],
)
def test_actuators_on_one_supply_agree_in_it(
    write: Write, tmp_path: Path, layer: str, message: str
) -> None:
    """Actuators that differ in line, oil or step are refused."""
    (tmp_path / "other.toml").write_text(layer)
    first, _, second = PAIR.rpartition(f'"{KNEE}"')
    with pytest.raises(UserError, match=message):
        load_machine([write(f'{first}"{KNEE}", "other.toml"{second}')])
