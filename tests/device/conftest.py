"""The device under test, and a stock master."""

import pytest
from device_master import CHANNELS, EDS, NODE_ID, SAFE_CURRENT, Master, booted

from hil_emulator.device.dictionary import Dictionary
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
    return booted(node)
