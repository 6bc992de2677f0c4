"""The device under test, and a stock master that hides how frames reach it."""

import pytest
from device_master import CHANNELS, EDS, NODE_ID, READINGS, SAFE_CURRENT, Master
from simulated_network import SimulatedNetwork

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.measured import Measured
from hil_emulator.device.node import Node


@pytest.fixture
def dictionary() -> Dictionary:
    """Return the dictionary of the shipped EDS."""
    return Dictionary.from_eds(EDS, NODE_ID)


@pytest.fixture
def node(dictionary: Dictionary) -> Node:
    """Return a device that has not been switched on."""
    return Node(dictionary, CHANNELS, {"valve_current": SAFE_CURRENT})


@pytest.fixture
def master(node: Node) -> Master:
    """Return a stock master on a bus with the device, which has booted."""
    network = SimulatedNetwork(node, Measured(list(READINGS), [0] * len(CHANNELS)))
    master = Master(network)
    master.run(1)
    return master
