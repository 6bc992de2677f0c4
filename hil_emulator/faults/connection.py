"""Targets of bus faults: the connection of one node, and the messages on it by name."""

from collections.abc import Callable
from typing import NamedTuple

from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID
from hil_emulator.device.node import Node
from hil_emulator.frame import Frame

BUS = "bus"
NODE = "node"
MESSAGE = "message"
MESSAGES = (
    "nmt", "sync", "emcy", "sdo", "heartbeat",
    *(f"rpdo{n}" for n in range(1, 5)),
    *(f"tpdo{n}" for n in range(1, 5)),
)  # fmt: skip
"""Names of messages of CiA 301; a COB-ID such as 0x185 names one as well."""


class NodeConnection(NamedTuple):
    """The connection of a node.

    Attributes:
        node: at its end.
        chosen: selects the frames that a fault acts on.

    """

    node: Node
    chosen: Callable[[Frame], bool]


def connection(node: Node, target: str) -> NodeConnection:
    """Return a node's connection and the frames of a target; COB-IDs are the present ones."""
    if target in (BUS, NODE):
        return NodeConnection(node, lambda frame: True)
    named = message_ids(node).get(target, set())
    ids = {int(target, 16)} if target.startswith("0x") else named
    return NodeConnection(node, lambda frame: frame.identifier in ids)


def message_ids(node: Node) -> dict[str, set[int]]:
    """Return the identifiers of a node's messages by name (predefined set: CiA 301 7.3.5)."""
    n = node.node_id
    named = {
        "nmt": {0x000},
        "sync": {0x080},
        "emcy": {0x080 + n},
        "sdo": {0x580 + n, 0x600 + n},
        "heartbeat": {ERROR_CONTROL_COB_ID + n},
    }
    return named | {pdo.name.lower(): {pdo.identifier} for pdo in node.pdos if pdo.exists}
