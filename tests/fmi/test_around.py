"""Functions of the emulator with an FMU as the plant: each works or is refused by a message."""

import math
import struct
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result

import hil_emulator as hil
from hil_emulator.__main__ import main
from hil_emulator.config.load import Configuration, load
from hil_emulator.errors import UserError
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator

KNEE = shipped("configs/hyq_knee.toml")

LAYER = """
[plant]
fmu = "crane.fmu"
[plant.inputs]
valve_current = "motor.i"
[plant.outputs]
position = "x[1]"
load_force = "motor.F"
"""

SCENARIO = f"""
title = "A motor of first order"
config = ["{KNEE}", "crane.toml"]
duration = "200 ms"
[[step]]
nmt = "start"
at = "10 ms"
set = {{ valve_current = "5 mA" }}
[[expect]]
signal = "model.load_force"
within = ["499.9 N", "500.1 N"]
from = "150 ms"
"""


@pytest.fixture
def layer(crane: Path) -> Path:
    """Return the layer that replaces the plant by the crane."""
    file = crane.with_name("crane.toml")
    file.write_text(LAYER)
    return file


@pytest.fixture
def emulator_config(layer: Path) -> Configuration:
    """Return the configuration for the fixtures of the pytest plugin."""
    return load([KNEE, layer])


def called(*words: str | Path) -> Result:
    """Run a command."""
    return CliRunner().invoke(main, [str(word) for word in words])


def test_the_pytest_fixtures_run_it(emulator: Emulator, can_bus: can.BusABC) -> None:
    """Set points of a test move it: 1 - e^-5 of 500 N after five time constants of 10 ms."""
    emulator.tick()
    can_bus.send(can.Message(arbitration_id=0, data=[1, 5], is_extended_id=False))
    for _ in range(50):
        can_bus.send(
            can.Message(arbitration_id=0x205, data=struct.pack("<i", 5_000_000),
                        is_extended_id=False)
        )  # fmt: skip
        emulator.tick()
    expected = 500.0 * (1.0 - math.exp(-5.0))
    assert emulator.signals.model.load_force == pytest.approx(expected, rel=1e-12)


def test_it_ends_with_its_emulator(layer: Path, unpacked: Path) -> None:
    """Neither files nor a process stay behind, although the emulator is still referenced."""
    with Emulator(load([KNEE, layer])) as made:
        made.tick()
        assert list(unpacked.iterdir())
    assert not list(unpacked.iterdir())
    assert made.recording().table()["model.position"].shape == (1,)


def test_a_scenario_is_played_on_it(layer: Path) -> None:
    """Its verdict follows from the force, 0.1 kN for each mA."""
    file = layer.with_name("scenario.toml")
    file.write_text(SCENARIO)
    done = called("scenario", file)
    assert done.exit_code == 0, done.output


def test_a_scenario_whose_fmu_fails_has_no_verdict(layer: Path) -> None:
    """The failure counts although the last force is as expected."""
    layer.write_text(f"{LAYER}[plant.parameters]\nmisdeed = 3")
    file = layer.with_name("scenario.toml")
    file.write_text(SCENARIO.replace('"499.9 N"', '"0 N"'))
    done = called("scenario", file)
    assert done.exit_code != 0
    assert "crane.fmu its step from 0.05 s failed" in " ".join(done.output.split())


def test_a_machine_goes_on_without_it_and_ends_with_a_clear_line(layer: Path) -> None:
    """The other actuator runs to the end; the exit code reports the failed one."""
    layer.write_text(f"{LAYER}[plant.parameters]\nmisdeed = 3")
    machine = layer.with_name("machine.toml")
    machine.write_text(
        "".join(
            f'[buses.{name}]\ninterface = "virtual"\nchannel = "machine {name}"\n'
            f'[[actuator]]\nname = "{name}"\nbus = "{name}"\nfiles = {files}\n'
            for name, files in (("hip", [str(KNEE)]), ("knee", [str(KNEE), "crane.toml"]))
        )
    )
    done = called("run", machine, "--clock", "lockstep", "--duration", "100 ms")
    assert done.exit_code == 1
    assert "0.100 s, 100 ticks" in done.output
    last = done.output.strip().splitlines()[-1]
    assert last.endswith("knee: crane.fmu its step from 0.05 s failed")


def test_a_recording_of_it_is_replayed_to_the_last_bit(layer: Path) -> None:
    """It needs the same FMU; without it, the message names the missing FMU."""
    record = layer.with_name("crane.rec")
    done = called("run", KNEE, layer, "--bus", "virtual:crane", "--clock", "lockstep",
                  "--duration", "50 ms", "--record", record)  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "the same, bit for bit" in called("replay", record).output
    fmu = layer.with_name("crane.fmu")
    aside = fmu.rename(fmu.with_suffix(".away"))
    lost = called("replay", record)
    aside.rename(fmu)
    assert lost.exit_code == 2
    assert "there is no such FMU" in lost.output


@pytest.mark.parametrize("command", ["identify", "gap"])
def test_a_comparison_of_the_model_with_data_needs_the_model(layer: Path, command: str) -> None:
    """One message, exit code 2, before any recording is read."""
    done = called(command, KNEE, layer, "run.csv")
    assert done.exit_code == 2
    assert "needs the built-in plant" in done.output


def test_the_python_interface_does_not_simulate_the_model_in_its_stead(layer: Path) -> None:
    """An actuator without a bus has no FMU: a configuration with one is refused."""
    actuator = hil.load(KNEE, layer)
    for asked in (lambda: actuator.simulate(duration="1 ms"), actuator.linearise):
        with pytest.raises(UserError, match="needs the built-in plant"):
            asked()
