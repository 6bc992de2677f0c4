"""Error control: heartbeat and guarding (CiA 301 7.2.8.2.2, 7.2.8.3.2)."""

from typing import Any

from hil_emulator.device import node_guarding
from hil_emulator.device.entry import Entry
from hil_emulator.device.error_control import Heartbeat
from hil_emulator.device.heartbeat_consumer import HeartbeatConsumer
from hil_emulator.device.nmt import State
from hil_emulator.device.nmt_slave import NmtSlave
from hil_emulator.device.node_guarding import NodeGuarding
from hil_emulator.frame import Frame
from mutations.mutant import Call, mutant


@mutant((Heartbeat, "_start"))
def heartbeat_too_slow(start: Call, heartbeat: Heartbeat, now_ns: int) -> None:
    """0x1017 counts ms: it counts 2 ms."""
    start(heartbeat, now_ns)
    heartbeat._period_ns *= 2


@mutant((Heartbeat, "publish"))
def heartbeat_shows_one_state(publish: Call, heartbeat: Heartbeat, now_ns: int, *given: Any) -> Any:
    """A heartbeat shows the state: PRE-OPERATIONAL always."""
    publish(heartbeat, now_ns, State.PRE_OPERATIONAL, given[1])


@mutant((Heartbeat, "publish"))
def heartbeat_silent(publish: Call, heartbeat: Heartbeat, *given: Any) -> None:
    """With 0x1017 heartbeats are sent: they are not."""


@mutant((Heartbeat, "changed"))
def heartbeat_never_off(changed: Call, heartbeat: Heartbeat, entry: Entry) -> None:
    """With 0x1017 at 0 there is no heartbeat: the old period goes on."""
    if entry.value:
        changed(heartbeat, entry)


@mutant((Heartbeat, "boot_up"))
def heartbeat_after_boot_missing(boot: Call, heartbeat: Heartbeat, now_ns: int) -> Any:
    """Heartbeats begin with the boot-up where 0x1017 is not 0: with a write of it."""
    frame = boot(heartbeat, now_ns)
    heartbeat.due_ns = 1 << 63
    return frame


@mutant((HeartbeatConsumer, "heard"))
def consumer_deaf(heard: Call, consumer: HeartbeatConsumer, now_ns: int, node_id: int) -> None:
    """A heartbeat that comes no more is reported (8130): it is not."""


@mutant((HeartbeatConsumer, "reset"))
def consumer_waits_for_the_first(reset: Call, consumer: HeartbeatConsumer) -> None:
    """A node is watched from its first heartbeat on: from the write of 0x1016 on."""
    reset(consumer)
    consumer._deadlines_ns = dict.fromkeys(consumer._times_ns, 0)
    consumer.due_ns = min(consumer._deadlines_ns.values(), default=1 << 63)


@mutant((HeartbeatConsumer, "reset"))
def consumer_too_patient(reset: Call, consumer: HeartbeatConsumer) -> None:
    """0x1016 counts ms: it counts 10 ms."""
    reset(consumer)
    consumer._times_ns = {node: 10 * time_ns for node, time_ns in consumer._times_ns.items()}


@mutant((HeartbeatConsumer, "reset"))
def consumer_watches_on(reset: Call, consumer: HeartbeatConsumer) -> None:
    """After a reset nodes are monitored only after a write of 0x1016: the old ones still are."""
    waiting = dict(vars(consumer))
    reset(consumer)
    consumer._deadlines_ns = waiting.get("_deadlines_ns", {})
    consumer.due_ns = waiting.get("due_ns", consumer.due_ns)


@mutant((HeartbeatConsumer, "check"))
def consumer_watches_twice(
    check: Call, consumer: HeartbeatConsumer, entry: Entry, value: int
) -> None:
    """One node in two entries of 0x1016 is refused (0604 0043): it is taken."""


@mutant((NmtSlave, "on_communication_error"))
def error_behaviour_missing(obey: Call, slave: NmtSlave) -> None:
    """A lost partner ends OPERATIONAL by 0x1029:01: the node stays in OPERATIONAL."""


@mutant((NmtSlave, "on_communication_error"))
def error_behaviour_fixed(obey: Call, slave: NmtSlave) -> None:
    """The state after a lost partner is that of 0x1029:01: always PRE-OPERATIONAL."""
    if slave.state is State.OPERATIONAL:
        slave.enter(State.PRE_OPERATIONAL)


@mutant((NodeGuarding, "request"))
def guarding_unanswered(request: Call, guarding: NodeGuarding, now_ns: int, data: bytes) -> None:
    """A guarding request is answered: it is not."""


@mutant((node_guarding, "_TOGGLE"))
def guarding_toggle_stuck(toggle: int) -> int:
    """The toggle bit alternates from answer to answer: it is 0."""
    return 0


@mutant((NodeGuarding, "reset"))
def guarding_toggle_kept_over_reset(reset: Call, guarding: NodeGuarding) -> None:
    """The first answer after a reset has toggle 0: the bit goes on alternating."""
    toggle = getattr(guarding, "_toggle", 0)
    reset(guarding)
    guarding._toggle = toggle


@mutant((NodeGuarding, "publish"))
def guarding_shows_one_state(
    publish: Call, guarding: NodeGuarding, state: State, frames: list[Frame]
) -> None:
    """A guarding answer shows the state: PRE-OPERATIONAL always."""
    publish(guarding, State.PRE_OPERATIONAL, frames)


@mutant((NodeGuarding, "expired"))
def life_guarding_missing(expired: Call, guarding: NodeGuarding, now_ns: int) -> bool:
    """A master that asks no more for the life time is reported (8130): it is not."""
    return False


@mutant((NodeGuarding, "request"))
def life_time_factor_ignored(
    request: Call, guarding: NodeGuarding, now_ns: int, data: bytes
) -> None:
    """The life time is guard time times life time factor: it is the guard time."""
    request(guarding, now_ns, data)
    if guarding._guard is not None and guarding._guard.value:
        guarding.due_ns = now_ns + guarding._guard.value * 1_000_000


@mutant((node_guarding, "PRODUCER_HEARTBEAT_TIME"))
def guarding_beside_heartbeat(index: int) -> int:
    """With a heartbeat there is no guarding: there are both."""
    return 0x1FFF
