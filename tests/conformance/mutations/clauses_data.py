"""Process data, SYNC and TIME by clause (CiA 301 7.2.2, 7.2.5, 7.2.6, 7.5.2.35 to 7.5.2.38)."""

from typing import Any

from hil_emulator.device import time_stamp
from hil_emulator.device.deadline import NEVER
from hil_emulator.device.entry import Entry
from hil_emulator.device.mapping import Mapping
from hil_emulator.device.nmt import State
from hil_emulator.device.node import Node
from hil_emulator.device.pdo import EVENT_MANUFACTURER, PdoParameters
from hil_emulator.device.pdo_records import EVENT_TIMER, LAST_DUMMY
from hil_emulator.device.process_data import ProcessData
from hil_emulator.device.rpdo import NS_PER_MS, Rpdo
from hil_emulator.device.sync import SyncProducer
from hil_emulator.device.time_stamp import DAYS_SHIFT, TimeStamp
from hil_emulator.device.tpdo import Tpdo
from mutations.mutant import Call, mutant

DAYS_1970_TO_1984 = 5113


# -- RPDO ---------------------------------------------------------------------------------------


@mutant((ProcessData, "check_deadlines"))
def rpdo_deadline_from_operational(check: Call, data: ProcessData, now_ns: int) -> None:
    """An RPDO that never came is not overdue: it is, its deadline after the start."""
    for rpdo in data._active_rpdos:
        overdue = rpdo._overdue in rpdo._emergency.active
        if rpdo._timeout_ns and rpdo.deadline_ns == NEVER and not overdue:
            rpdo.deadline_ns = now_ns + rpdo._timeout_ns
            data.deadline_ns = min(data.deadline_ns, rpdo.deadline_ns)
    check(data, now_ns)


@mutant((Mapping, "unpack"))
def rpdo_dummy_without_room(unpack: Call, mapped: Mapping, data: bytes) -> Any:
    """A dummy takes its room in an RPDO: the object behind it has the dummy's bytes."""
    entries = mapped.entries
    if not any(entry.index <= LAST_DUMMY for entry in entries):
        return unpack(mapped, data)
    real = Mapping([entry for entry in entries if entry.index > LAST_DUMMY])
    values = iter(real.unpacker(data))
    return [0 if entry.index <= LAST_DUMMY else next(values) for entry in entries]


@mutant((Rpdo, "start"))
def rpdo_held_over_stop(start: Call, rpdo: Rpdo) -> None:
    """What waits for SYNC is forgotten with OPERATIONAL: the next SYNC after it applies it."""
    held = getattr(rpdo, "_held", None)
    start(rpdo)
    rpdo._held = held


@mutant((Rpdo, "sync"))
def rpdo_held_data_again(sync: Call, rpdo: Rpdo, now_ns: int, window_ns: int) -> Any:
    """A synchronous RPDO is applied once: at each SYNC until the next comes."""
    held = rpdo._held
    applied = sync(rpdo, now_ns, window_ns)
    rpdo._held = held
    return applied


@mutant((Rpdo, "receive"))
def rpdo_first_of_a_cycle(receive: Call, rpdo: Rpdo, now_ns: int, data: bytes) -> Any:
    """Of several synchronous RPDOs before a SYNC the last counts: the first."""
    held = rpdo._held
    taken = receive(rpdo, now_ns, data)
    rpdo._held = held if held is not None else rpdo._held
    return taken


@mutant((ProcessData, "_select"))
def rpdo_invalid_taken(select: Call, data: ProcessData) -> None:
    """With bit 31 of its COB-ID an RPDO does not exist: it is taken once it has existed."""
    before = list(getattr(data, "_active_rpdos", []))
    select(data)
    for rpdo in data._active_rpdos:
        rpdo.kept = rpdo._mapping, rpdo._size, rpdo._targets  # type: ignore[attr-defined]
    for rpdo in [r for r in before if r not in data._active_rpdos and not r._size]:
        rpdo._mapping, rpdo._size, rpdo._targets = rpdo.kept  # type: ignore[attr-defined]
        data._active_rpdos.append(rpdo)


# -- TPDO ---------------------------------------------------------------------------------------


@mutant((PdoParameters, "changed"))
def tpdo_event_timer_at_next_start(changed: Call, parameters: PdoParameters, entry: Entry) -> None:
    """A new event timer counts at once: from the next change of state on."""
    if entry.subindex != EVENT_TIMER or entry.index != parameters._communication:
        changed(parameters, entry)


@mutant((Tpdo, "start"))
def tpdo_first_sync_missed(start: Call, tpdo: Tpdo) -> None:
    """Type 1 is sent at each SYNC: not at the first one."""
    start(tpdo)
    tpdo._sync_start = 0
    tpdo._syncs_left = tpdo._type + 1


@mutant((Tpdo, "start"))
def tpdo_sync_start_once(start: Call, tpdo: Tpdo) -> None:
    """The SYNC start value counts whenever OPERATIONAL begins: until it has been met."""
    met = getattr(tpdo, "_sync_start", None) == 0 and tpdo.parameters.sync_start
    start(tpdo)
    if met:
        tpdo._sync_start = 0


@mutant((Tpdo, "sync"))
def tpdo_sync_start_used_up(sync: Call, tpdo: Tpdo, counter: int) -> None:
    """The SYNC start value waits for its counter: it is over with the first SYNC."""
    if tpdo._sync_start:
        tpdo._sync_start = 0
        tpdo._syncs_left = 1
    sync(tpdo, counter)


@mutant((Tpdo, "request"))
def tpdo_answers_twice(request: Call, tpdo: Tpdo) -> None:
    """A remote frame is answered by one TPDO: by two."""
    request(tpdo)
    request(tpdo)


@mutant((Tpdo, "request"))
def tpdo_event_driven_without_request(request: Call, tpdo: Tpdo) -> None:
    """Bit 30 of the COB-ID allows remote frames: types 254 and 255 do not answer them."""
    if tpdo._type < EVENT_MANUFACTURER:
        request(tpdo)


@mutant((Tpdo, "publish"))
def tpdo_event_timer_drifts(publish: Call, tpdo: Tpdo, now_ns: int, frames: Any) -> None:
    """The event timer counts ms: each period is half as long again."""
    before_ns = tpdo.next_ns
    publish(tpdo, now_ns, frames)
    if tpdo.next_ns not in (before_ns, NEVER):
        tpdo.next_ns += tpdo.period_ns // 2
        tpdo.wakes_ns = max(tpdo.wakes_ns, tpdo.next_ns) if not tpdo._event else tpdo.wakes_ns


# -- SYNC and TIME ------------------------------------------------------------------------------


@mutant((SyncProducer, "due"))
def sync_counter_goes_on(due: Call, producer: SyncProducer, now_ns: int) -> Any:
    """The counter begins with 1 whenever producing begins: it goes on."""
    counter = producer._counter
    frame = due(producer, now_ns)
    if frame is None:
        producer._counter = counter
    return frame


@mutant((SyncProducer, "produces"), (SyncProducer, "_period_ns"))
def sync_goes_on(current: Call, producer: SyncProducer) -> Any:
    """Without bit 30 of 0x1005 no SYNC is produced: a running producer goes on."""
    value, running = current(producer), producer._running_ns
    return value or (running > 0 if isinstance(value, bool) else running)


@mutant((Node, "_produce"))
def sync_in_operational_alone(produce: Call, node: Node, now_ns: int, frames: Any) -> None:
    """PRE-OPERATIONAL has SYNC: it is produced in OPERATIONAL alone."""
    if node.state is State.OPERATIONAL:
        produce(node, now_ns, frames)


@mutant((SyncProducer, "due"))
def sync_period_fixed(due: Call, producer: SyncProducer, now_ns: int) -> Any:
    """A new cycle period counts at once: the first one stays."""
    running = producer._running_ns
    if running and producer._period_ns():
        producer._period_ns = lambda: running  # type: ignore[method-assign]
    return due(producer, now_ns)


@mutant((TimeStamp, "due"))
def time_from_1970(due: Call, time: TimeStamp, now_ns: int) -> Any:
    """TIME counts days from 1984: from 1970."""
    frame = due(time, now_ns)
    if frame is None:
        return None
    value = int.from_bytes(frame.data, "little") + (DAYS_1970_TO_1984 << DAYS_SHIFT)
    return frame._replace(data=value.to_bytes(6, "little"))


@mutant((TimeStamp, "due"))
def time_reserved_bits(due: Call, time: TimeStamp, now_ns: int) -> Any:
    """The upper four bits of the milliseconds are 0: they are 1."""
    frame = due(time, now_ns)
    if frame is None:
        return None
    data = frame.data
    return frame._replace(data=data[:3] + bytes([data[3] | 0xF0]) + data[4:])


@mutant((time_stamp, "NS_PER_MS"))
def time_in_centiseconds(ns_per_ms: int) -> int:
    """TIME counts ms: it counts 10 ms."""
    return 10 * NS_PER_MS
