"""COB-ID collisions: producers and consumers on one bus (CiA 301 7.3.5).

An identifier belongs to one service and has one producer. Many nodes may receive SYNC, TIME or the
same PDO, and the PDO that one node sends may be received by others. An SDO request has one server.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hil_emulator.device import cob_id
from hil_emulator.device.dictionary import UNCONFIGURED, Dictionary
from hil_emulator.device.emergency import EMCY_BASE, EMCY_COB_ID
from hil_emulator.device.error_control import ERROR_CONTROL_COB_ID
from hil_emulator.device.lss import LSS_ANSWER, LSS_REQUEST
from hil_emulator.device.nmt import NMT_COB_ID
from hil_emulator.device.node import Node
from hil_emulator.device.sdo_channels import servers
from hil_emulator.device.sync import SYNC_COB_ID
from hil_emulator.device.time_stamp import TIME_COB_ID


class _Use(NamedTuple):
    """One service of one node that uses an identifier."""

    identifier: int
    service: str
    name: str
    alone: bool


def collisions(nodes: Sequence[Node]) -> list[str]:
    """Return one message for each node-ID and each COB-ID that collides on a bus.

    Args:
        nodes: all nodes of one bus.

    """
    messages = []
    nodes = [node for node in nodes if node.node_id != UNCONFIGURED]
    numbers = [node.node_id for node in nodes]
    for number in sorted({n for n in numbers if numbers.count(n) > 1}):
        messages.append(f"two nodes have the node-ID {number}; give each node on a bus its own")
    uses: defaultdict[int, list[_Use]] = defaultdict(list)
    for node in {node.node_id: node for node in nodes}.values():
        for use in _uses(node):
            uses[use.identifier].append(use)
    for identifier, users in sorted(uses.items()):
        if len({use.service for use in users}) > 1 or sum(use.alone for use in users) > 1:
            names = " and ".join(dict.fromkeys(use.name for use in users))
            messages.append(f"COB-ID 0x{identifier:03X} is used by {names}; give each its own")
    return messages


def _uses(node: Node) -> Iterator[_Use]:
    """Yield every use a node makes of an identifier, as it is configured now."""
    dictionary, number = node.dictionary, node.node_id
    for can_id, service in ((NMT_COB_ID, "NMT"), (LSS_REQUEST, "LSS"), (LSS_ANSWER, "LSS")):
        yield _Use(can_id, service, service, alone=False)
    yield _Use(
        ERROR_CONTROL_COB_ID + number, "heartbeat", f"heartbeat of node {number}", alone=True
    )
    for server in servers(dictionary).values():
        if server.exists:
            yield _Use(server.request_can_id, "SDO", f"SDO request of node {number}", alone=True)
            yield _Use(server.answer_can_id, "SDO", f"SDO answer of node {number}", alone=True)
    yield from _broadcasts(dictionary, number)
    for pdo in node.pdos:
        if pdo.active:
            yield _Use(pdo.identifier, "PDO", f"{pdo.name} of node {number}", alone=not pdo.receive)


def _broadcasts(dictionary: Dictionary, number: int) -> Iterator[_Use]:
    """Yield EMCY, SYNC and TIME."""
    emergency = _cob_id(dictionary, EMCY_COB_ID, EMCY_BASE + number)
    if not emergency & cob_id.INVALID:
        can_id = emergency & cob_id.CAN_ID_MASK
        yield _Use(can_id, "EMCY", f"EMCY of node {number}", alone=True)
    for index, service in ((SYNC_COB_ID, "SYNC"), (TIME_COB_ID, "TIME")):
        value = _cob_id(dictionary, index, 0)
        producer = bool(value & cob_id.PRODUCER)
        if value:
            name = f"{service} of node {number}" if producer else service
            yield _Use(value & cob_id.CAN_ID_MASK, service, name, alone=producer)


def _cob_id(dictionary: Dictionary, index: int, missing: int) -> int:
    entry = dictionary.get(index)
    return missing if entry is None else int(entry.value)
