"""A machine whose actuators share a supply: settings, faults, recordings and what is refused."""

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
    """Return a function that writes a machine's file, and its supply's beside it."""

    def write(text: str = PAIR, pump: str = PUMP) -> Path:
        (tmp_path / "pump.toml").write_text(pump)
        (tmp_path / "reset.toml").write_text('[rig]\nnot_finite = "reset"')
        file = tmp_path / "machine.toml"
        file.write_text(text)
        return file

    return write


@pytest.fixture
def assembled() -> Iterator[Assembled]:
    """Return a function that makes a machine, and a peer on each of its buses."""
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
    """Open some valves for a while; return the supply pressure in the end."""
    for tick in range(ticks):
        for name, peer in peers.items():
            peer.send([START] if tick < 2 else [set_point(6.0 if name in names else 0.0)])
        machine.step()
    return pressures(machine)


@pytest.mark.slow
def test_the_supply_droops_further_when_both_move(write: Write, assembled: Assembled) -> None:
    """Each reads the one pressure, whoever draws."""
    lowest = []
    for names in (("hip",), ("hip", "knee")):
        found = move(*assembled(write()), 50, *names)
        assert found[0] == found[1]
        lowest.append(found[0])
    assert lowest[1] < lowest[0] - 5e5 < 155e5


@pytest.mark.slow
def test_both_sensors_of_supply_pressure_read_the_shared_one(
    write: Write, assembled: Assembled
) -> None:
    """Each with its own noise of 0.1 bar."""
    machine, peers = assembled(write())
    move(machine, peers, 50, "hip")
    (shared, _), read = pressures(machine), []
    for rig in machine.rigs.values():
        read.append(rig.value("supply_pressure"))
    assert read == pytest.approx([shared] * 2, abs=0.5e5)
    assert read[0] != read[1]


def test_a_setting_of_one_is_that_of_the_shared_supply(write: Write, assembled: Assembled) -> None:
    """120 bar said to the knee are 120 bar for the hip."""
    machine, peers = assembled(write())
    machine.rigs["knee"].set("supply_pressure", 120e5)
    assert move(machine, peers, 200) == pytest.approx([120e5] * 2, rel=5e-3)


def test_a_pump_that_fails_for_one_fails_for_all_until_it_ends(
    write: Write, assembled: Assembled
) -> None:
    """It begins under a condition of the rig that it was injected into, and ends for both."""
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


def test_actuators_on_one_supply_begin_again_together(
    write: Write, assembled: Assembled, caplog: pytest.LogCaptureFixture
) -> None:
    """One has lost its state: all are at rest again in the same tick, and see one pump."""
    machine, peers = assembled(write(PAIR.replace(str(KNEE) + '"', f'{KNEE}", "reset.toml"')))
    move(machine, peers, 50, "hip")
    hip, knee = machine.rigs.values()
    knee.plant.state.pressure_a = np.nan
    machine.step()
    assert "pressure_a" in caplog.records[0].message
    found = [rig.plant.state_vector.tolist() for rig in (hip, knee)]
    assert found[0] == found[1]
    assert move(machine, peers, 10) == pytest.approx([160e5] * 2, rel=5e-3)


def test_every_clock_gives_the_same_bits(write: Write, assembled: Assembled) -> None:
    """Lock-step and a wall clock: the exchange of flows is part of the integration step."""
    found = []
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
        found.append([rig.plant.state_vector.tolist() for rig in machine.rigs.values()])
    assert found[0] == found[1]


def test_a_recording_says_with_whom_its_supply_was_shared(
    write: Write, assembled: Assembled, tmp_path: Path
) -> None:
    """Replay refuses it; identification takes it without a pump, and says what it lacks."""
    file = write()
    machine, peers = assembled(file)
    knee = load_machine([file]).actuators[1].config
    journal = tmp_path / "knee.rec"
    machine.rigs["knee"].recorder = recorder = FileRecorder([journal], header(knee, []))
    move(machine, peers, 100, "hip", "knee")
    recorder.close()
    with pytest.raises(UserError, match=r"supply shared with hip: what they drew is not in it"):
        replay(journal, [])
    with pytest.raises(UserError, match=r"shared with hip.*leave fixed_pump out"):
        experiments([journal], load([KNEE, tmp_path / "pump.toml"]), Meaning())
    (experiment,) = experiments([journal], load([KNEE]), Meaning())
    assert np.nanmin(experiment.readings["supply_pressure"]) < 150e5
    assert any("supply shared with hip" in note for note in experiment.notes)


@pytest.mark.slow
def test_an_actuator_may_keep_a_supply_of_its_own(write: Write, assembled: Assembled) -> None:
    """What the hip draws is nothing to a knee that names no supply."""
    text = PAIR.removesuffix('supply = "pump"\n')
    found = move(*assembled(write(text)), 50, "hip")
    assert found[0] < 155e5
    assert found[1] == 160e5


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('supply = "pump"\n', 'supply = "pomp"\n', "there is no supply 'pomp'; there are: pump"),
        ('supply = "pump"\n', "", "no actuator is on supply pump; write supply ="),
        ('files = ["pump.toml"]', "files = []", "supplies.pump.files"),
        ('files = ["pump.toml"]', 'files = ["none.toml"]', "no such"),
    ],
)
def test_a_mistake_in_a_supply_is_named(write: Write, old: str, new: str, message: str) -> None:
    """What is wrong, where, and what to do."""
    assert old in PAIR
    with pytest.raises(UserError, match=message):
        load_machine([write(PAIR.replace(old, new))])


@pytest.mark.parametrize(
    ("said", "message"),
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
    write: Write, tmp_path: Path, said: str, message: str
) -> None:
    """A line, an oil or a step that only one of them has is refused."""
    (tmp_path / "other.toml").write_text(said)
    first, _, second = PAIR.rpartition(f'"{KNEE}"')
    with pytest.raises(UserError, match=message):
        load_machine([write(f'{first}"{KNEE}", "other.toml"{second}')])
