"""Nodes on one bus must not share identifiers."""

from pathlib import Path

import pytest
from instruments import CHANNELS, FOLDER

from hil_emulator.device.collisions import collisions
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.node import Node


def node(name: str, number: int, **values: int) -> Node:
    """Return a node, with some objects given other defaults: `x1014=...`, `x1800_1=...`."""
    dictionary = Dictionary.from_eds(FOLDER / f"{name}.eds", number)
    for key, value in values.items():
        index, _, subindex = key[1:].partition("_")
        entry = dictionary.entry(int(index, 16), int(subindex or 0))
        entry.default = entry.value = value
    commands = {"valve_current": 0.0} if name == "valve_driver" else {}
    return Node(dictionary, CHANNELS, commands)


def layout() -> list[Node]:
    """Return the four instruments of an actuator."""
    names = ("valve_driver", "load_cell", "pressure_transmitter", "position_sensor")
    return [node(name, 5 + n) for n, name in enumerate(names)]


def test_the_predefined_connection_set_does_not_collide() -> None:
    """The four instruments have no identifier in common."""
    assert collisions(layout()) == []


def test_one_node_id_twice() -> None:
    """One message, not one for each service of the node."""
    (message,) = collisions([node("load_cell", 5), node("position_sensor", 5)])
    assert "node-ID 5" in message


def test_two_senders_of_a_pdo() -> None:
    """The message names both nodes."""
    (message,) = collisions([*layout(), node("load_cell", 9, x1800_1=0x186)])
    assert message == (
        "COB-ID 0x186 is used by TPDO1 of node 6 and TPDO1 of node 9; give each its own"
    )


@pytest.mark.parametrize(
    ("objects", "named"),
    [
        ({"x1014": 0x185}, "EMCY of node 9"),
        ({"x1014": 0x80}, "SYNC"),
        ({"x1800_1": 0x605}, "SDO request of node 5"),
        ({"x1800_1": 0x588}, "SDO answer of node 8"),
        ({"x1800_1": 0x705}, "heartbeat of node 5"),
        ({"x1201_1": 0x605, "x1201_2": 0x6C0}, "SDO request of node 5"),
        ({"x1005": 0x185}, "TPDO1 of node 5"),
        ({"x1800_1": 0x100}, "TIME"),
    ],
)
def test_two_services_on_one_identifier(objects: dict[str, int], named: str) -> None:
    """An identifier belongs to one service."""
    (message,) = collisions([*layout(), node("load_cell", 9, **objects)])
    assert named in message
    assert "node 9" in message or "SYNC" in message


def test_two_producers_of_sync() -> None:
    """A bus has one SYNC."""
    first, second = (
        node("load_cell", 5, x1005=1 << 30 | 0x80),
        node("load_cell", 6, x1005=1 << 30 | 0x80),
    )
    (message,) = collisions([first, second])
    assert "SYNC of node 5 and SYNC of node 6" in message


def test_a_pdo_may_have_many_receivers() -> None:
    """Two valves may receive one set point, and a node may receive the PDO of another node."""
    first, second = node("valve_driver", 5), node("valve_driver", 6, x1400_1=0x205)
    assert collisions([first, second]) == []
    follower = node("valve_driver", 7, x1400_1=0x185)
    assert collisions([first, follower]) == []


def test_what_does_not_exist_does_not_collide() -> None:
    """A PDO or EMCY whose COB-ID is invalid uses no identifier."""
    silent = node("load_cell", 9, x1800_1=1 << 31 | 0x186, x1014=1 << 31 | 0x85)
    assert collisions([*layout(), silent]) == []


def test_asking_changes_nothing(tmp_path: Path) -> None:
    """The check does not change the nodes: their services still own their objects."""
    nodes = layout()
    assert collisions(nodes) == collisions(nodes) == []
