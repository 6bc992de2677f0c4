"""SYNC, TIME, EMCY, storing (CiA 301 7.2.5 to 7.2.7, 7.5.2)."""

from typing import Any

from hil_emulator.device import storage, time_stamp
from hil_emulator.device.cob_id import INVALID
from hil_emulator.device.dictionary import ALL_OBJECTS
from hil_emulator.device.emergency import EMCY_COB_ID, ERROR_HISTORY, Emergency, ErrorBit, ErrorCode
from hil_emulator.device.entry import Entry
from hil_emulator.device.storage import RESTORE_PARAMETERS, STORE_PARAMETERS, ParameterStore
from hil_emulator.device.sync import SYNC_COUNTER_OVERFLOW, SyncConsumer, SyncProducer
from hil_emulator.device.time_stamp import TimeStamp
from hil_emulator.device.verify_configuration import VerifyConfiguration
from hil_emulator.frame import Frame
from mutations.mutant import Call, mutant

SYNC, TIME = 0x080, 0x100

# -- SYNC -------------------------------------------------------------------------------------


@mutant((SyncConsumer, "accept"))
def sync_of_any_length(accept: Call, sync: SyncConsumer, data: bytes) -> int:
    """A SYNC with another length than by 0x1019 is ignored and reported (8240): it is accepted."""
    return data[0] if data else 0


@mutant((SyncConsumer, "can_id"))
def sync_identifier_fixed(can_id: Call, sync: SyncConsumer) -> int:
    """SYNC has the identifier of 0x1005: 0x80 always."""
    return SYNC


@mutant((SyncConsumer, "check"))
def sync_overflow_changed_while_running(
    check: Call, sync: SyncConsumer, entry: Entry, value: int
) -> None:
    """0x1019 is locked while 0x1006 is not 0: it is not."""
    period, sync._period = sync._period, None
    try:
        check(sync, entry, value)
    finally:
        sync._period = period


@mutant((SyncConsumer, "check"))
def sync_overflow_of_one(check: Call, sync: SyncConsumer, entry: Entry, value: int) -> None:
    """0x1019 is 0 or 2 to 240: 1 and more than 240 are taken."""
    check(sync, entry, 0 if entry.index == SYNC_COUNTER_OVERFLOW else value)


@mutant((SyncConsumer, "check"))
def sync_identifier_moved_while_producing(
    check: Call, sync: SyncConsumer, entry: Entry, value: int
) -> None:
    """The identifier of a SYNC that is produced cannot be changed: it can."""
    if entry.index == SYNC_COUNTER_OVERFLOW:
        check(sync, entry, value)


@mutant((SyncProducer, "due"))
def sync_never_produced(due: Call, producer: SyncProducer, now_ns: int) -> None:
    """With bit 30 of 0x1005, SYNC is produced: it is not."""


@mutant((SyncProducer, "_period_ns"))
def sync_period_doubled(period_ns: Call, producer: SyncProducer) -> Any:
    """0x1006 counts us: it counts 2 us."""
    return 2 * period_ns(producer)


@mutant((SyncProducer, "_data"))
def sync_counter_from_zero(data: Call, producer: SyncProducer) -> bytes:
    """The counter of SYNC runs from 1 to 0x1019: from 0 to 0x1019 - 1."""
    return bytes([byte - 1 for byte in data(producer)])


@mutant((SyncProducer, "_data"))
def sync_without_counter(data: Call, producer: SyncProducer) -> bytes:
    """With 0x1019 SYNC has a counter: it has no counter."""
    return b""


# -- EMCY -------------------------------------------------------------------------------------


@mutant((Emergency, "_send"))
def emcy_reset_never_sent(send: Call, emergency: Emergency, code: int, details: bytes) -> None:
    """When all errors are gone, 0000 is sent: it is not."""
    if code != ErrorCode.NONE:
        send(emergency, code, details)


@mutant((Emergency, "raise_error"))
def emcy_repeated(
    report: Call, emergency: Emergency, key: Any, code: int, bit: ErrorBit, details: bytes = b""
) -> None:
    """An emergency is sent once per error event: whenever the error is seen again."""
    emergency.active.pop(key, None)
    report(emergency, key, code, bit, details)


@mutant((Emergency, "_send"))
def emcy_without_register(send: Call, emergency: Emergency, code: int, details: bytes) -> None:
    """An emergency carries the error register: 0."""
    send(emergency, code, details)
    emergency.queue.append(emergency.queue.pop()[:2] + b"\0" + details.ljust(5, b"\0"))


@mutant((Emergency, "_update_register"))
def emcy_register_stays(update: Call, emergency: Emergency) -> None:
    """An error that is gone leaves the error register: it stays."""
    before = emergency._register.value
    update(emergency)
    emergency._register.value |= before


@mutant((Emergency, "_update_register"))
def emcy_register_not_generic(update: Call, emergency: Emergency) -> None:
    """Bit 0 of the error register is set with any error: it is not."""
    update(emergency)
    emergency._register.value &= ~ErrorBit.GENERIC


@mutant((Emergency, "_record"))
def emcy_history_oldest_first(record: Call, emergency: Emergency, error: Any) -> None:
    """The newest error is in 0x1003:01: in the last field used."""
    record(emergency, error)
    used = emergency._history[: emergency._count.value]  # type: ignore[union-attr]
    values = [field.value for field in used]
    for field, value in zip(used, [*values[1:], values[0]], strict=True):
        field.value = value


@mutant((Emergency, "_record"))
def emcy_history_empty(record: Call, emergency: Emergency, error: Any) -> None:
    """0x1003 remembers errors: it does not."""


@mutant((Emergency, "_record"))
def emcy_history_of_one(record: Call, emergency: Emergency, error: Any) -> None:
    """0x1003 keeps the errors before: it forgets them."""
    emergency._clear_history()
    record(emergency, error)


@mutant((Emergency, "changed"))
def emcy_history_not_cleared(changed: Call, emergency: Emergency, entry: Entry) -> None:
    """0 written to 0x1003:00 empties the history: the errors stay in it."""


@mutant((Emergency, "check"))
def emcy_history_takes_any_count(
    check: Call, emergency: Emergency, entry: Entry, value: int
) -> None:
    """0x1003:00 takes 0 alone (0609 0030): it takes all."""
    if entry.index != ERROR_HISTORY:
        check(emergency, entry, value)


@mutant((Emergency, "publish"))
def emcy_identifier_fixed(
    publish: Call, emergency: Emergency, now_ns: int, frames: list[Frame]
) -> None:
    """EMCY has the identifier of 0x1014: the predefined one always."""
    emergency._cob_id = None
    publish(emergency, now_ns, frames)


@mutant((Emergency, "publish"))
def emcy_valid_always(
    publish: Call, emergency: Emergency, now_ns: int, frames: list[Frame]
) -> None:
    """With bit 31 of 0x1014 there is no EMCY: there is."""
    entry = emergency._dictionary.get(EMCY_COB_ID)
    assert entry is not None
    kept, entry.value = entry.value, entry.value & ~INVALID
    publish(emergency, now_ns, frames)
    entry.value = kept


@mutant((Emergency, "publish"))
def emcy_inhibit_time_ignored(
    publish: Call, emergency: Emergency, now_ns: int, frames: list[Frame]
) -> None:
    """Between two emergencies lies 0x1015: nothing does."""
    emergency._inhibit = None
    publish(emergency, now_ns, frames)


# -- TIME -------------------------------------------------------------------------------------


@mutant((TimeStamp, "receive"))
def time_not_taken(receive: Call, time: TimeStamp, now_ns: int, data: bytes) -> None:
    """With bit 31 of 0x1012 TIME is consumed: it is not."""


@mutant((TimeStamp, "can_id"))
def time_taken_always(can_id: Call, time: TimeStamp) -> int:
    """Without bit 31 of 0x1012 TIME is not consumed: it is."""
    return TIME


@mutant((TimeStamp, "receive"))
def time_of_any_length(receive: Call, time: TimeStamp, now_ns: int, data: bytes) -> None:
    """TIME has six bytes: a shorter one is filled with zeros."""
    receive(time, now_ns, data[:6].ljust(6, b"\0"))


@mutant((TimeStamp, "due"))
def time_never_produced(due: Call, time: TimeStamp, now_ns: int) -> None:
    """With bit 30 of 0x1012 TIME is produced: it is not."""


@mutant((TimeStamp, "due"))
def time_stands_still(due: Call, time: TimeStamp, now_ns: int) -> Any:
    """TIME carries the ms since midnight: always the same value."""
    frame = due(time, now_ns)
    return frame and Frame(frame.can_id, bytes(6))


@mutant((time_stamp, "_LENGTH"))
def time_of_eight_bytes(length: int) -> int:
    """TIME is a TIME_OF_DAY of six bytes: of eight."""
    return 8


# -- storing ----------------------------------------------------------------------------------


@mutant((ParameterStore, "check"))
def storing_without_signature(check: Call, store: ParameterStore, entry: Entry, value: int) -> None:
    """0x1010 takes "save" alone: it takes any number."""
    if entry.index == RESTORE_PARAMETERS:
        check(store, entry, value)


@mutant((ParameterStore, "check"))
def restoring_without_signature(
    check: Call, store: ParameterStore, entry: Entry, value: int
) -> None:
    """0x1011 takes "load" alone: it takes any number."""
    if entry.index == STORE_PARAMETERS:
        check(store, entry, value)


@mutant((ParameterStore, "changed"))
def storing_in_vain(changed: Call, store: ParameterStore, entry: Entry) -> None:
    """What was saved is there after a reset: it is lost."""
    if entry.index == RESTORE_PARAMETERS:
        changed(store, entry)


@mutant((ParameterStore, "changed"))
def restoring_in_vain(changed: Call, store: ParameterStore, entry: Entry) -> None:
    """What was restored is at its default after a reset: it is as saved."""
    if entry.index == STORE_PARAMETERS:
        changed(store, entry)


@mutant((ParameterStore, "changed"))
def restoring_at_once(changed: Call, store: ParameterStore, entry: Entry) -> None:
    """Defaults are restored with the next reset: at once."""
    changed(store, entry)
    if entry.index == RESTORE_PARAMETERS:
        store.reset(ALL_OBJECTS)


@mutant((storage, "RANGES"))
def storing_communication_stores_all(ranges: dict[int, range]) -> dict[int, range]:
    """Sub-index 2 of 0x1010 and 0x1011 applies to communication parameters: to all."""
    return {**ranges, 2: ALL_OBJECTS}


@mutant((storage, "RANGES"))
def storing_application_stores_nothing(ranges: dict[int, range]) -> dict[int, range]:
    """Sub-index 3 of 0x1010 and 0x1011 applies to application parameters: to no parameter."""
    return {**ranges, 3: range(0)}


@mutant((VerifyConfiguration, "_written"))
def configuration_date_stays(written: Call, verify: VerifyConfiguration, entry: Entry) -> None:
    """0x1020 is 0 once a parameter has changed: it stays."""
