"""Serial numbers distinguish equal nodes."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import canopen
import pytest
from rigs import reference

from hil_emulator.config.load import Configuration, load
from hil_emulator.config.machine import load_machine
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.platform.paths import shipped
from hil_emulator.simulation.emulator import Emulator
from hil_emulator.simulation.node_factory import nodes
from hil_emulator.testing.lockstep_network import LockStepNetwork

NAMES = [channel.name for channel in CHANNELS]
WAITING, CONFIGURATION = 0, 1
UNCONFIGURED = 0xFF


def serials(config: Configuration) -> list[int]:
    """Return the serial numbers of a configuration's nodes."""
    return [int(node.dictionary.entry(0x1018, 4).value) for node in nodes(config, NAMES)]


def twins() -> Configuration:
    """Return the reference machine with two equal nodes, 5 and 6."""
    config = reference()
    first = config.nodes[0]
    return dataclasses.replace(config, nodes=(first, dataclasses.replace(first, id=6, commands={})))


@pytest.fixture
def lss(monkeypatch: pytest.MonkeyPatch) -> Iterator[canopen.lss.LssMaster]:
    """Yield a stock LSS master on the bus of two unconfigured nodes."""
    monkeypatch.setattr("canopen.lss.time.sleep", lambda seconds: None)
    monkeypatch.setattr(canopen.lss.LssMaster, "RESPONSE_TIMEOUT", 0)
    emulator = Emulator(twins())
    network = LockStepNetwork(emulator)
    emulator.run_for("5 ms")
    network.lss.send_switch_state_global(CONFIGURATION)
    network.lss.configure_node_id(UNCONFIGURED)
    network.lss.send_switch_state_global(WAITING)
    network.nmt.send_command(130)
    emulator.run_for("5 ms")
    yield network.lss
    network.disconnect()
    emulator.close()


def test_fastscan_finds_one_node_after_the_other(lss: canopen.lss.LssMaster) -> None:
    """Two equal nodes without node-IDs are found in the order of their serial numbers."""
    serial_numbers = []
    for node_id in (0x21, 0x22):
        there, address = lss.fast_scan()
        assert there
        serial_numbers.append(address[3])
        lss.configure_node_id(node_id)
        lss.send_switch_state_global(WAITING)
    assert lss.fast_scan() == (False, None)
    assert serial_numbers == serials(twins())
    for node_id, serial in zip((0x21, 0x22), serial_numbers, strict=True):
        node = lss.network.add_node(node_id, str(reference().nodes[0].eds))
        assert node.sdo[0x1018][4].raw == serial


def test_the_nodes_of_a_machine_have_different_numbers() -> None:
    """Serial numbers are unique over all buses, and the same at every start."""
    machine = load_machine([shipped("configs/hyq_leg.toml")])
    numbers = [number for a in machine.actuators for number in serials(a.config)]
    assert len(set(numbers)) == 8
    assert numbers == [number for a in machine.actuators for number in serials(a.config)]


def test_a_configured_number_wins_over_that_of_the_eds(tmp_path: Path) -> None:
    """`serial_number` replaces the number of the EDS."""
    config = reference()
    text = config.nodes[0].eds.read_text(encoding="latin-1")
    eds = tmp_path / "own.eds"
    section = "[1018sub4]\n"
    eds.write_text(text.replace(section, section + "DefaultValue=4711\n"), encoding="latin-1")
    node = dataclasses.replace(config.nodes[0], eds=eds)
    assert serials(dataclasses.replace(config, nodes=(node,))) == [4711]
    layer = tmp_path / "layer.toml"
    layer.write_text(f'[[node]]\nid = 7\neds = "{eds}"\nserial_number = 99\n')
    assert serials(load([shipped("configs/hyq_knee.toml"), layer])) == [99]
