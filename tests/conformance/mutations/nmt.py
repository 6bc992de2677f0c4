"""NMT: commands, states, and which services each state has (CiA 301 7.2.8 and 7.3.2)."""

from collections.abc import Sequence
from typing import Any

from hil_emulator.device import nmt
from hil_emulator.device.dictionary import ALL_OBJECTS, COMMUNICATION_OBJECTS
from hil_emulator.device.nmt import Command, State
from hil_emulator.device.nmt_slave import NmtSlave
from hil_emulator.device.node import Node
from hil_emulator.device.storage import ParameterStore
from hil_emulator.frame import Frame
from mutations.mutant import Call, mutant

PARSE, RESET = (nmt, "parse"), (NmtSlave, "reset")
RECEIVE, PUBLISH, ROUTE = (Node, "receive"), (Node, "publish"), (Node, "_route")
ERROR_CONTROL = 0x700


# -- commands ---------------------------------------------------------------------------------


@mutant(PARSE)
def nmt_of_three_bytes(parse: Call, data: bytes, node_id: int) -> Any:
    """An NMT message has two bytes: a longer one is obeyed."""
    return parse(data[:2], node_id)


@mutant(PARSE)
def nmt_of_one_byte(parse: Call, data: bytes, node_id: int) -> Any:
    """An NMT message has two bytes: a command without an address is taken for all nodes."""
    return parse(data.ljust(2, b"\0"), node_id)


@mutant(PARSE)
def nmt_to_others(parse: Call, data: bytes, node_id: int) -> Any:
    """A command is for the node in its second byte: those to others are obeyed."""
    return parse(data[:1] + bytes([node_id]), node_id)


@mutant(PARSE)
def nmt_deaf_to_all(parse: Call, data: bytes, node_id: int) -> Any:
    """Node-ID 0 addresses all nodes: such a command is ignored."""
    return None if data[1:] == b"\0" else parse(data, node_id)


@mutant(PARSE)
def nmt_unknown_command_starts(parse: Call, data: bytes, node_id: int) -> Any:
    """Command specifiers are 1, 2, 128, 129 and 130: any other starts the node."""
    valid = not data or data[0] in set(Command)
    return parse(data if valid else bytes([Command.START]) + data[1:], node_id)


@mutant((NmtSlave, "request"))
def nmt_stays_stopped(obey: Call, slave: NmtSlave, now_ns: int, data: bytes) -> None:
    """Enter PRE-OPERATIONAL is obeyed in every state: not in STOPPED."""
    if slave.state is not State.STOPPED or data[0] != Command.ENTER_PRE_OPERATIONAL:
        obey(slave, now_ns, data)


@mutant(RECEIVE)
def nmt_29_bit_taken_for_11(receive: Call, node: Node, now_ns: int, frames: Sequence[Frame]) -> Any:
    """Identifiers of 11 and of 29 bits are different ones: one is taken for the other."""
    return receive(node, now_ns, [frame._replace(extended=False) for frame in frames])


# -- resets -----------------------------------------------------------------------------------


@mutant(RESET)
def nmt_resets_swapped(reset: Call, slave: NmtSlave, indices: range) -> None:
    """Reset node resets all, reset communication the communication profile: the other way round."""
    reset(slave, COMMUNICATION_OBJECTS if indices == ALL_OBJECTS else ALL_OBJECTS)


@mutant(RESET)
def nmt_reset_node_resets_communication(reset: Call, slave: NmtSlave, indices: range) -> None:
    """Reset node sets application objects to their power-on values: they are left alone."""
    reset(slave, COMMUNICATION_OBJECTS)


@mutant(RESET)
def nmt_reset_communication_resets_all(reset: Call, slave: NmtSlave, indices: range) -> None:
    """Reset communication leaves application objects alone: they are reset, too."""
    reset(slave, ALL_OBJECTS)


@mutant((ParameterStore, "reset"))
def nmt_resets_keep_parameters(reset: Call, store: ParameterStore, indices: range) -> None:
    """A reset sets communication parameters to their power-on values: they stay."""


@mutant((ParameterStore, "reset"))
def nmt_reset_communication_keeps_parameters(
    reset: Call, store: ParameterStore, indices: range
) -> None:
    """Reset communication sets communication parameters to power-on values: they stay."""
    if indices == ALL_OBJECTS:
        reset(store, indices)


@mutant(PUBLISH)
def nmt_no_boot_up(publish: Call, node: Node, now_ns: int, measured: Any) -> list[Frame]:
    """Initialisation ends with the boot-up message: it is not sent."""
    frames = publish(node, now_ns, measured)
    return [f for f in frames if f.can_id < ERROR_CONTROL or f.data != b"\0"]


@mutant((NmtSlave, "self_starting"))
def nmt_starts_by_itself(starts: Call, slave: NmtSlave) -> bool:
    """After boot-up the node is PRE-OPERATIONAL (without 0x1F80): it enters OPERATIONAL."""
    return True


# -- services of the states -------------------------------------------------------------------


@mutant(ROUTE)
def stopped_takes_sdo(route: Call, node: Node) -> None:
    """STOPPED has no SDO: a download is obeyed, though not answered."""
    route(node)
    if node.state is State.STOPPED:
        routes: dict[int, list[Any]] = {}
        node._services.sdo.add_routes(routes)
        node._routes |= {can_id: handlers[0] for can_id, handlers in routes.items()}


@mutant(PUBLISH)
def stopped_sends_emergencies(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """STOPPED has no EMCY: emergencies are sent."""
    frames = publish(node, now_ns, measured)
    if node.state is State.STOPPED:
        node._services.emergency.publish(now_ns, frames)
    return frames


@mutant(PUBLISH)
def stopped_sends_pdos(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """STOPPED has no PDO: event timers go on."""
    frames = publish(node, now_ns, measured)
    if node.state is State.STOPPED:
        node._pdos.publish(now_ns, frames)
    return frames


@mutant(PUBLISH)
def stopped_produces_sync(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """STOPPED has no SYNC: its producer goes on."""
    frames = publish(node, now_ns, measured)
    if node.state is State.STOPPED and node._produces:
        node._produce(now_ns, frames)
    return frames


@mutant(PUBLISH)
def stopped_sends_no_heartbeat(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """STOPPED has error control: there is no heartbeat."""
    frames = publish(node, now_ns, measured)
    return [f for f in frames if node.state is not State.STOPPED or f.can_id < ERROR_CONTROL]


@mutant(ROUTE)
def stopped_takes_rpdos(route: Call, node: Node) -> None:
    """STOPPED has no PDO: RPDOs are taken."""
    route(node)
    if node.state is State.STOPPED:
        routes: dict[int, list[Any]] = {}
        node._pdos.add_routes(routes, {})
        node._routes |= {can_id: handlers[0] for can_id, handlers in routes.items()}


@mutant(ROUTE)
def pre_operational_takes_rpdos(route: Call, node: Node) -> None:
    """PRE-OPERATIONAL has no PDO: RPDOs are taken."""
    route(node)
    if node.state is State.PRE_OPERATIONAL:
        routes: dict[int, list[Any]] = {}
        node._pdos.add_routes(routes, {})
        node._routes |= {can_id: handlers[0] for can_id, handlers in routes.items()}


@mutant(PUBLISH)
def pre_operational_sends_pdos(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """PRE-OPERATIONAL has no PDO: event timers send them."""
    frames = publish(node, now_ns, measured)
    if node.state is State.PRE_OPERATIONAL:
        node._pdos.publish(now_ns, frames)
    return frames
