"""PDO: what they carry, when they are sent, how they are configured (CiA 301 7.2.2, 7.5.2.35)."""

from typing import Any

from hil_emulator.device import cob_id, mapping, pdo
from hil_emulator.device.cob_id import INVALID
from hil_emulator.device.entry import Entry
from hil_emulator.device.mapping import Mapping
from hil_emulator.device.pdo import PdoParameters
from hil_emulator.device.pdo_records import INHIBIT_TIME, SYNC_START, TRANSMISSION_TYPE
from hil_emulator.device.process_data import ProcessData
from hil_emulator.device.rpdo import Rpdo
from hil_emulator.device.tpdo import Tpdo
from hil_emulator.frame import Frame
from mutations.mutant import Call, mutant

PACK, UNPACK = (Mapping, "pack"), (Mapping, "unpack")
CHECK = (PdoParameters, "check")


# -- payload ----------------------------------------------------------------------------------


@mutant((Rpdo, "_store"))
def rpdo_never_stored(store: Call, rpdo: Rpdo, data: bytes) -> None:
    """An RPDO is written to the objects it maps: it is not."""


@mutant(UNPACK)
def rpdo_reversed(unpack: Call, mapped: Mapping, data: bytes) -> Any:
    """The least significant byte of an RPDO is the first: it is the last."""
    return unpack(mapped, data[: mapped.size][::-1])


@mutant(PACK)
def tpdo_reversed(pack: Call, mapped: Mapping) -> bytes:
    """The least significant byte of a TPDO is the first: it is the last."""
    return bytes(pack(mapped)[::-1])


@mutant(PACK)
def tpdo_of_zeros(pack: Call, mapped: Mapping) -> bytes:
    """A TPDO shows the objects it maps: zeros."""
    return bytes(mapped.size)


@mutant(PACK)
def tpdo_of_the_past(pack: Call, mapped: Mapping) -> bytes:
    """A TPDO shows the values of now: those of its first transmission."""
    if not hasattr(mapped, "first"):
        mapped.first = pack(mapped)  # type: ignore[attr-defined]
    return mapped.first  # type: ignore[attr-defined,no-any-return]


@mutant((Mapping, "__init__"))
def pdo_last_object_first(init: Call, mapped: Mapping, entries: Any) -> None:
    """The first object mapped is in the first bytes: in the last ones."""
    init(mapped, list(entries)[::-1])


@mutant(PACK)
def tpdo_of_eight_bytes(pack: Call, mapped: Mapping) -> bytes:
    """A TPDO is as long as its mapping: it has eight bytes always."""
    return bytes(pack(mapped).ljust(8, b"\0"))


# -- reception --------------------------------------------------------------------------------


@mutant((Rpdo, "start"))
def rpdo_synchronous_at_once(start: Call, rpdo: Rpdo) -> None:
    """A synchronous RPDO is applied with the next SYNC: at once."""
    start(rpdo)
    rpdo._synchronous = False


@mutant((Rpdo, "sync"))
def rpdo_synchronous_never(sync: Call, rpdo: Rpdo, now_ns: int, window_ns: int) -> bool:
    """A synchronous RPDO is applied with the next SYNC: never."""
    return False


@mutant((Rpdo, "sync"))
def rpdo_window_too_short(sync: Call, rpdo: Rpdo, now_ns: int, window_ns: int) -> Any:
    """0x1007 counts us: it counts ns, so that RPDOs inside the window are dropped."""
    return sync(rpdo, now_ns, window_ns // 1000)


@mutant((Rpdo, "receive"))
def rpdo_short_filled(receive: Call, rpdo: Rpdo, now_ns: int, data: bytes) -> Any:
    """An RPDO that is too short is not taken, and reported (8210): it is filled with zeros."""
    return receive(rpdo, now_ns, data.ljust(rpdo.parameters.mapping.size, b"\0"))


@mutant((Rpdo, "receive"))
def rpdo_short_dropped_in_silence(receive: Call, rpdo: Rpdo, now_ns: int, data: bytes) -> Any:
    """An RPDO that is too short is reported (8210): it is not."""
    return len(data) >= rpdo.parameters.mapping.size and receive(rpdo, now_ns, data)


@mutant((Rpdo, "_check_length"))
def rpdo_long_dropped(check: Call, rpdo: Rpdo, length: int) -> Any:
    """The first bytes of an RPDO that is too long are used: it is ignored."""
    return check(rpdo, length) and length == rpdo.parameters.mapping.size


@mutant((Rpdo, "expired"))
def rpdo_deadline_ignored(expired: Call, rpdo: Rpdo, now_ns: int) -> bool:
    """An RPDO that is overdue is reported (8250): it is not."""
    return False


# -- transmission -----------------------------------------------------------------------------


@mutant((PdoParameters, "inhibit_us"))
def tpdo_inhibit_time_ignored(inhibit_us: Call, parameters: PdoParameters) -> int:
    """Between two event-driven TPDOs lies the inhibit time: nothing does."""
    return 0


@mutant((PdoParameters, "inhibit_us"))
def tpdo_inhibit_time_in_ms(inhibit_us: Call, parameters: PdoParameters) -> Any:
    """The inhibit time counts 100 us: it counts ms."""
    return 10 * inhibit_us(parameters)


@mutant((PdoParameters, "event_timer_ms"))
def tpdo_event_timer_ignored(event_timer_ms: Call, parameters: PdoParameters) -> Any:
    """The event timer has a TPDO sent: it does not."""
    return event_timer_ms(parameters) if parameters.receive else 0


@mutant((PdoParameters, "event_timer_ms"))
def tpdo_event_timer_too_slow(event_timer_ms: Call, parameters: PdoParameters) -> Any:
    """The event timer counts ms: it counts 2 ms."""
    return event_timer_ms(parameters) * (1 if parameters.receive else 2)


@mutant((Tpdo, "sync"))
def tpdo_at_every_sync(sync: Call, tpdo: Tpdo, counter: int) -> None:
    """Type n is sent at every n-th SYNC: at every one."""
    tpdo._syncs_left = 1
    sync(tpdo, counter)


@mutant((Tpdo, "start"))
def tpdo_one_sync_late(start: Call, tpdo: Tpdo) -> None:
    """Type n is sent at every n-th SYNC: at every (n+1)-th."""
    start(tpdo)
    if 1 <= tpdo._type <= 240:
        tpdo._type += 1
        tpdo._syncs_left += 1


@mutant((Tpdo, "_at_sync"))
def tpdo_acyclic_at_every_sync(at_sync: Call, tpdo: Tpdo) -> None:
    """Type 0 is sent at a SYNC if there was an event: at every SYNC."""
    tpdo._last = None
    at_sync(tpdo)


@mutant((ProcessData, "publish"))
def tpdo_acyclic_at_once(
    publish: Call, pdos: ProcessData, now_ns: int, frames: list[Frame]
) -> None:
    """Type 0 waits for the SYNC after its event: it does not."""
    for tpdo in pdos._active:
        if tpdo._type == 0 and tpdo._mapping.pack() != tpdo._last:
            tpdo._event, tpdo.wakes_ns = True, now_ns
    publish(pdos, now_ns, frames)


@mutant((PdoParameters, "sync_start"))
def tpdo_sync_start_ignored(sync_start: Call, parameters: PdoParameters) -> int:
    """The SYNC start value is the counter of the first SYNC: any SYNC is the first."""
    return 0


@mutant((Tpdo, "request"))
def tpdo_remote_frame_unanswered(request: Call, tpdo: Tpdo) -> None:
    """A remote frame has a TPDO sent, where its COB-ID allows it: it does not."""


@mutant((Tpdo, "request"))
def tpdo_remote_frame_answered_always(request: Call, tpdo: Tpdo) -> None:
    """Bit 30 of the COB-ID forbids remote frames: they are answered."""
    tpdo.requests += 1
    tpdo.wakes_ns = 0


@mutant((Tpdo, "_at_sync"))
def tpdo_request_shows_now(at_sync: Call, tpdo: Tpdo) -> None:
    """Type 252 shows the values of the last SYNC: those of now."""
    at_sync(tpdo)
    tpdo._sampled = None


# -- configuration ----------------------------------------------------------------------------


@mutant((cob_id, "check_change"))
def pdo_identifier_changed_while_valid(check: Call, old: int, new: int, **given: bool) -> None:
    """The identifier of a valid PDO, SDO or EMCY cannot be changed: it can."""
    check(old | INVALID, new, **given)


@mutant((cob_id, "check_can_id"))
def pdo_restricted_identifier_taken(check: Call, value: int, **given: bool) -> None:
    """Restricted identifiers (7.3.5) are refused: they are taken."""


@mutant((PdoParameters, "exists"))
def pdo_valid_always(exists: Call, parameters: PdoParameters) -> bool:
    """With bit 31 of its COB-ID a PDO does not exist: it does."""
    return True


@mutant((PdoParameters, "can_id"))
def pdo_identifier_fixed(can_id: Call, parameters: PdoParameters) -> Any:
    """A PDO has the identifier of its COB-ID: that of the first one for ever."""
    return parameters.__dict__.setdefault("first_id", can_id(parameters))


@mutant((PdoParameters, "_check_mapping"))
def pdo_mapped_while_valid(check: Call, parameters: PdoParameters, entry: Entry, value: int) -> Any:
    """The mapping of a valid PDO cannot be changed: it can."""
    if entry.subindex == 0:
        parameters._mapping_of(value)


@mutant((PdoParameters, "_count"))
def pdo_entries_changed_while_counted(count: Call, parameters: PdoParameters) -> Any:
    """Mapping entries are written while sub-index 0 is 0: at any time while it is invalid."""
    return count(parameters) if parameters.exists else 0


@mutant((mapping, "MAX_BITS"))
def pdo_of_more_than_64_bits(bits: int) -> int:
    """A PDO maps 64 bits at most (0604 0042): it may map more."""
    return 1 << 16


@mutant((Entry, "receivable"), (Entry, "transmittable"))
def pdo_maps_the_unmappable(mappable: Call, entry: Entry) -> bool:
    """What PDOMapping or AccessType forbid is not mapped (0604 0041): it is."""
    return True


@mutant((pdo, "resolve"))
def pdo_mapped_length_unchecked(resolve: Call, dictionary: Any, word: int, *, receive: bool) -> Any:
    """A mapping entry has the length of its object (0604 0041): any length will do."""
    entry = dictionary.get(word >> 16, word >> 8 & 0xFF)
    bits = word & 0xFF if entry is None else entry.type.bits
    return resolve(dictionary, word & ~0xFF | bits, receive=receive)


@mutant((PdoParameters, "load"))
def pdo_mapped_anew_in_vain(load: Call, parameters: PdoParameters) -> None:
    """A PDO has its present mapping: it has its first mapping."""
    load(parameters)
    if parameters.mapping.entries:
        parameters.mapping = parameters.__dict__.setdefault("first", parameters.mapping)


@mutant((PdoParameters, "transmission_type"))
def pdo_type_changed_in_vain(transmission_type: Call, parameters: PdoParameters) -> Any:
    """A PDO is sent by its present transmission type: by its first type."""
    return parameters.__dict__.setdefault("first_type", transmission_type(parameters))


@mutant(CHECK)
def pdo_reserved_type_taken(
    check: Call, parameters: PdoParameters, entry: Entry, value: int
) -> None:
    """Transmission types 241 to 251 are reserved (0609 0030): they are taken."""
    if entry.index == parameters._mapping or entry.subindex != TRANSMISSION_TYPE:
        check(parameters, entry, value)


@mutant(CHECK)
def pdo_inhibit_time_changed_while_valid(
    check: Call, parameters: PdoParameters, entry: Entry, value: int
) -> None:
    """The inhibit time of a valid PDO cannot be changed: it can."""
    if entry.index == parameters._mapping or entry.subindex != INHIBIT_TIME:
        check(parameters, entry, value)


@mutant(CHECK)
def pdo_sync_start_changed_while_valid(
    check: Call, parameters: PdoParameters, entry: Entry, value: int
) -> None:
    """The SYNC start value of a valid PDO cannot be changed: it can."""
    if entry.index == parameters._mapping or entry.subindex != SYNC_START:
        check(parameters, entry, value)
