"""Changes that are events: the key Delta of the EDS (CiA 301 7.2.2, event-driven)."""

import struct
from pathlib import Path

import pytest
from device_master import CHANNELS, NODE_ID, READINGS, TPDO2, Master, booted
from edited_eds import edited

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node

POSITION = "Unit=m\nFactor=1e-7\n"


def event_driven(tmp_path: Path, delta: str) -> Master:
    """Return a node whose TPDO2 maps only the position and has no event timer."""
    path = edited(tmp_path, (POSITION, f"{POSITION}Delta={delta}\n"))
    node = Node(Dictionary.from_eds(path, NODE_ID), CHANNELS, {"valve_current": 0.0})
    master = booted(node, path)
    communication, mapping = master.remote.sdo[0x1801], master.remote.sdo[0x1A01]
    communication[1].raw = 1 << 31 | TPDO2
    mapping[0].raw = 0
    mapping[1].raw = 0x2020_0020
    mapping[0].raw = 1
    communication[2].raw, communication[5].raw = 255, 0
    communication[1].raw = TPDO2
    master.start()
    master.run(1)
    master.forget()
    return master


def sent(master: Master, *positions: float) -> list[float]:
    """Return the positions in TPDO2 [m] for a series of positions."""
    for position in positions:
        master.measure((*READINGS[:3], position, READINGS[4]))
        master.run(1)
    return [round(struct.unpack("<i", data)[0] * 1e-7, 7) for data in master.data(TPDO2)]


def test_without_delta_every_change_is_sent(tmp_path: Path) -> None:
    """A delta of 0 makes every change an event."""
    assert sent(event_driven(tmp_path, "0"), 0.1001, 0.1002, 0.1002) == [0.1001, 0.1002]


def test_a_delta_suppresses_small_changes(tmp_path: Path) -> None:
    """Only a change by 10 000 digits, 1 mm, since the last event is an event."""
    master = event_driven(tmp_path, "10000")
    assert sent(master, 0.1004, 0.1008, 0.1011, 0.1004, 0.1001) == [0.1011, 0.1001]


@pytest.mark.parametrize("delta", ["much", "nan", "inf"])
def test_a_delta_is_a_number(tmp_path: Path, delta: str) -> None:
    """Any other text has a remark with its place, and every change is an event."""
    master = event_driven(tmp_path, delta)
    assert sent(master, 0.1001, 0.1002) == [0.1001, 0.1002]
    (remark,) = master.network.node.dictionary.remarks
    assert (remark.section, remark.key) == ("2020", "Delta")
