"""The two layouts of the reference machine, exported."""

from pathlib import Path

import pytest

from hil_emulator.commands.export import contents
from hil_emulator.config.load import Configuration
from hil_emulator.config.machine import MachineSettings, load_machine
from hil_emulator.device.node import Node
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.node_factory import nodes

COMBINED = ("configs/hyq_knee.toml",)
SEPARATE = ("configs/hyq_knee.toml", "configs/hyq_knee_separate.toml")


@pytest.fixture(params=[COMBINED, SEPARATE], ids=["combined", "separate"])
def machine(request: pytest.FixtureRequest) -> MachineSettings:
    """Return one of the layouts."""
    return load_machine([shipped(name) for name in request.param])


@pytest.fixture
def config(machine: MachineSettings) -> Configuration:
    """Return its only actuator."""
    return machine.actuators[0].config


@pytest.fixture
def made(config: Configuration) -> list[Node]:
    """Return its nodes."""
    return nodes(config, [channel.name for channel in CHANNELS])


@pytest.fixture
def folder(machine: MachineSettings, tmp_path: Path) -> Path:
    """Return a folder with its exported files."""
    for name, text in contents(machine).items():
        (tmp_path / name).write_text(text, encoding="latin-1")
    return tmp_path
