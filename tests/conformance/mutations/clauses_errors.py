"""Errors by clause: emergencies, their history and register, error control (CiA 301)."""

from typing import Any

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.emergency import Emergency, ErrorBit
from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import Heartbeat
from hil_emulator.device.heartbeat_consumer import HeartbeatConsumer
from hil_emulator.device.nmt import State
from hil_emulator.device.nmt_slave import NmtSlave
from hil_emulator.device.node import Node
from hil_emulator.device.node_guarding import NodeGuarding
from hil_emulator.device.rpdo import Rpdo
from hil_emulator.frame import Frame
from mutations.mutant import Call, mutant

# -- emergencies: 7.2.7, 7.5.2.2, 7.5.2.4, 7.5.2.18 ---------------------------------------------


@mutant((Emergency, "publish"))
def emcy_inhibit_tenfold(
    publish: Call, emergency: Emergency, now_ns: int, frames: list[Frame]
) -> None:
    """0x1015 counts 100 us: it counts ms."""
    before_ns = emergency._free_ns
    publish(emergency, now_ns, frames)
    if emergency._free_ns != before_ns:
        emergency._free_ns += 9 * (emergency._free_ns - now_ns)


@mutant((Emergency, "changed"))
def emcy_history_ends_with_clear(changed: Call, emergency: Emergency, entry: Entry) -> None:
    """Errors after the history was cleared are in it: they are not."""
    changed(emergency, entry)
    emergency._record = lambda error: None  # type: ignore[method-assign]


@mutant((Emergency, "_clear_history"))
def emcy_history_keeps_fields(clear: Call, emergency: Emergency) -> None:
    """A cleared history has no errors: its counter is 0, and the old ones come back."""
    if emergency._count is not None:
        emergency._count.value = 0


@mutant((HeartbeatConsumer, "heard"))
def emcy_stays_after_heartbeat(
    heard: Call, consumer: HeartbeatConsumer, now_ns: int, node_id: int
) -> None:
    """The error is gone when heartbeats are back: it stays."""
    clear, consumer._emergency.clear = consumer._emergency.clear, lambda key: None  # type: ignore[method-assign]
    heard(consumer, now_ns, node_id)
    consumer._emergency.clear = clear  # type: ignore[method-assign]


@mutant((NodeGuarding, "request"))
def emcy_stays_after_guarding(
    request: Call, guarding: NodeGuarding, now_ns: int, data: bytes
) -> None:
    """The error is gone when the master asks again: it stays."""
    clear, guarding._emergency.clear = guarding._emergency.clear, lambda key: None  # type: ignore[method-assign]
    request(guarding, now_ns, data)
    guarding._emergency.clear = clear  # type: ignore[method-assign]


@mutant((Rpdo, "receive"))
def emcy_stays_after_rpdo(receive: Call, rpdo: Rpdo, now_ns: int, data: bytes) -> Any:
    """The error is gone when an overdue RPDO is back: it stays."""
    overdue, rpdo._overdue = rpdo._overdue, ("", "")
    taken = receive(rpdo, now_ns, data)
    rpdo._overdue = overdue
    return taken


@mutant((Emergency, "_send"))
def emcy_of_three_bytes(send: Call, emergency: Emergency, code: int, details: bytes) -> None:
    """An emergency has eight bytes: it has three."""
    send(emergency, code, details)
    emergency.queue.append(emergency.queue.pop()[:3])


@mutant((Emergency, "reset"))
def emcy_history_survives_reset(reset: Call, emergency: Emergency) -> None:
    """After a reset there is no error in the history: those before are."""
    before = list(getattr(emergency, "active", {}).values())
    reset(emergency)
    for error in before:
        emergency._record(error)


@mutant((Emergency, "_update_register"))
def emcy_wrong_register_bit(update: Call, emergency: Emergency) -> None:
    """Communication errors set bit 4 of the error register: they set bit 5."""
    update(emergency)
    register = emergency._register
    if register.value & ErrorBit.COMMUNICATION:
        register.value = register.value & ~ErrorBit.COMMUNICATION | ErrorBit.PROFILE


@mutant((Emergency, "reset"))
def emcy_register_survives_reset(reset: Call, emergency: Emergency) -> None:
    """After a reset the error register is 0 while nothing is wrong: it is as before."""
    before = [error.bit for error in getattr(emergency, "active", {}).values()]
    reset(emergency)
    for bit in before:
        emergency._register.value |= bit


@mutant((Node, "publish"))
def emcy_in_operational_alone(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """PRE-OPERATIONAL has EMCY: emergencies wait for OPERATIONAL."""
    queue = node._services.emergency.queue
    kept = list(queue) if node.state is State.PRE_OPERATIONAL else []
    if kept:
        queue.clear()
    frames = publish(node, now_ns, measured)
    queue.extendleft(reversed(kept))
    return frames


# -- heartbeat and guarding: 7.2.8.3.2, 7.5.2.19, 7.5.2.32 ---------------------------------------


@mutant((HeartbeatConsumer, "reset"))
def consumer_of_one_node(reset: Call, consumer: HeartbeatConsumer) -> None:
    """Each entry of 0x1016 names a node to watch: the first one alone."""
    entries, consumer._entries = consumer._entries, consumer._entries[:1]
    reset(consumer)
    consumer._entries = entries


@mutant((HeartbeatConsumer, "expired"))
def consumer_reports_once(expired: Call, consumer: HeartbeatConsumer, now_ns: int) -> Any:
    """A node that is back is watched again: it is watched once."""
    lost = expired(consumer, now_ns)
    if lost:
        consumer._times_ns = dict.fromkeys(consumer._times_ns, NEVER // 2)
    return lost


@mutant((HeartbeatConsumer, "heard"))
def consumer_counts_from_the_first(
    heard: Call, consumer: HeartbeatConsumer, now_ns: int, node_id: int
) -> None:
    """Each heartbeat begins the time anew: the first one alone."""
    if node_id not in consumer._deadlines_ns:
        heard(consumer, now_ns, node_id)


@mutant((HeartbeatConsumer, "changed"))
def consumer_never_stops(changed: Call, consumer: HeartbeatConsumer, entry: Entry) -> None:
    """With 0 in 0x1016 the node is watched no more: it still is."""
    if entry.value:
        changed(consumer, entry)


@mutant((NodeGuarding, "expired"))
def error_behaviour_of_guarding_missing(expired: Call, guarding: NodeGuarding, now_ns: int) -> bool:
    """A life guarding event obeys 0x1029:01: it is reported only."""
    expired(guarding, now_ns)
    return False


@mutant((NmtSlave, "enter"))
def guarding_toggle_restarts(enter: Call, slave: NmtSlave, state: State) -> None:
    """The toggle bit goes on through the states: each change of state begins with 0."""
    enter(slave, state)
    slave._services.guarding._toggle = 0


@mutant((NodeGuarding, "publish"))
def guarding_of_two_bytes(
    publish: Call, guarding: NodeGuarding, state: State, frames: list[Frame]
) -> None:
    """A guarding answer has one byte: it has two."""
    before = len(frames)
    publish(guarding, state, frames)
    frames[before:] = [frame._replace(data=frame.data + b"\0") for frame in frames[before:]]


@mutant((Heartbeat, "publish"))
def heartbeat_not_in_operational(
    publish: Call, heartbeat: Heartbeat, now_ns: int, state: State, frames: list[Frame]
) -> None:
    """OPERATIONAL has error control: there is no heartbeat."""
    publish(heartbeat, now_ns, state, [] if state is State.OPERATIONAL else frames)


@mutant((Node, "publish"))
def boot_up_twice(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """There is one boot-up message: a second one follows."""
    again = node.state is State.INITIALISING
    frames = publish(node, now_ns, measured)
    return [*frames, *frames[-1:]] if again else frames


@mutant((Node, "publish"))
def boot_up_at_start(publish: Call, node: Node, now_ns: int, measured: Any) -> Any:
    """The boot-up message ends initialisation: entering OPERATIONAL sends one, too."""
    frames = publish(node, now_ns, measured)
    before, node.shown = getattr(node, "shown", node.state), node.state  # type: ignore[attr-defined]
    if before is not State.OPERATIONAL and node.state is State.OPERATIONAL:
        frames.append(Frame(0x700 + node.node_id, b"\0"))
    return frames


@mutant((Heartbeat, "changed"))
def heartbeat_time_taken_at_reset(changed: Call, heartbeat: Heartbeat, entry: Entry) -> None:
    """A new heartbeat time counts at once: a running one goes on."""
    if not heartbeat._period_ns:
        changed(heartbeat, entry)


@mutant((Rpdo, "expired"))
def rpdo_deadline_reported_once(expired: Call, rpdo: Rpdo, now_ns: int) -> Any:
    """An RPDO that is back and overdue again is reported again: once alone."""
    if getattr(rpdo, "reported", False) and now_ns >= rpdo.deadline_ns:
        rpdo.deadline_ns = NEVER
        return True
    rpdo.reported = expired(rpdo, now_ns) or getattr(rpdo, "reported", False)  # type: ignore[attr-defined]
    return rpdo.deadline_ns == NEVER
