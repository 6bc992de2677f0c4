"""PDO parameters: the rules of 0x1400, 0x1600, 0x1800 and 0x1A00 (CiA 301 7.5.2.35 to 38).

Rules, in the order in which they apply when a master remaps a PDO:

1. While a PDO exists (bit 31 of its COB-ID clear), CAN-ID, inhibit time and mapping are locked.
2. Mapping entries may be written only while the number of mapped objects is 0.
3. Setting that number checks all entries together: each mappable, 64 bits at most.
4. Clearing bit 31 again brings the PDO to life with its new mapping.
"""

from collections.abc import Callable, Iterable
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.mapping import Mapping, resolve
from hil_emulator.device.pdo_records import (
    COB_ID,
    EVENT_TIMER,
    INHIBIT_TIME,
    MAX_PDOS,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    SYNC_START,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
    TRANSMISSION_TYPE,
)
from hil_emulator.frame import EXTENDED

SYNC_ACYCLIC = 0
SYNC_CYCLIC_MAX = 240
RTR_SYNC = 252
RTR_EVENT = 253
EVENT_MANUFACTURER = 254
EVENT_PROFILE = 255

RPDO_TYPES = frozenset({*range(SYNC_CYCLIC_MAX + 1), EVENT_MANUFACTURER, EVENT_PROFILE})
TPDO_TYPES = RPDO_TYPES | {RTR_SYNC, RTR_EVENT}


class PdoParameters:
    """Communication and mapping record of one PDO, kept consistent.

    Args:
        dictionary: the node's dictionary.
        number: 1 for RPDO1 or TPDO1.
        receive: whether this is an RPDO.

    Attributes:
        name: such as "TPDO1".
        receive: as given.
        mapping: objects of the PDO; empty while it does not exist.
        on_change: called after each accepted change.

    Raises:
        SdoAbort: the default mapping is faulty.

    """

    def __init__(self, dictionary: Dictionary, number: int, *, receive: bool) -> None:
        self.name = f"{'RPDO' if receive else 'TPDO'}{number}"
        self.mapping = Mapping(())
        self.on_change: Callable[[], None] = lambda: None
        self._dictionary = dictionary
        self.receive = receive
        self._communication = number - 1 + (RPDO_COMMUNICATION if receive else TPDO_COMMUNICATION)
        self._mapping = number - 1 + (RPDO_MAPPING if receive else TPDO_MAPPING)
        for index in (self._communication, self._mapping):
            dictionary.watch(index, self)
        count = dictionary.get(self._mapping, 0)
        if count is not None:
            count.high = None  # too many objects are 0604 0042, whatever limit the EDS has
        self.load()

    @property
    def cob_id(self) -> int:
        """The COB-ID parameter with its flags."""
        return self._value(COB_ID, cob_id.INVALID)

    @property
    def can_id(self) -> int:
        """The identifier, of 11 or 29 bits."""
        return cob_id.number(self.cob_id)

    @property
    def extended(self) -> bool:
        """Whether the identifier has 29 bits."""
        return bool(self.cob_id & EXTENDED)

    @property
    def identifier(self) -> int:
        """The unique identifier of its frames: see `Frame.identifier`."""
        return self.can_id | self.cob_id & EXTENDED

    @property
    def exists(self) -> bool:
        """Whether bit 31 of the COB-ID is clear."""
        return not self.cob_id & cob_id.INVALID

    @property
    def active(self) -> bool:
        """Whether the PDO exists and maps something."""
        return self.exists and bool(self.mapping.entries)

    @property
    def transmission_type(self) -> int:
        """0 to 240 synchronous, 252 and 253 on request, 254 and 255 event-driven."""
        return self._value(TRANSMISSION_TYPE, EVENT_PROFILE)

    @property
    def synchronous(self) -> bool:
        """Whether the transmission type refers to SYNC."""
        kind = self.transmission_type
        return kind <= SYNC_CYCLIC_MAX or kind == RTR_SYNC

    @property
    def inhibit_us(self) -> int:
        """Shortest time between two event-driven transmissions."""
        return 100 * self._value(INHIBIT_TIME, 0)

    @property
    def event_timer_ms(self) -> int:
        """Period of an event-driven TPDO, deadline of an RPDO; 0 is off."""
        return self._value(EVENT_TIMER, 0)

    @property
    def sync_start(self) -> int:
        """Value of the SYNC counter a cyclic TPDO starts at; 0 is any."""
        return self._value(SYNC_START, 0)

    def load(self) -> None:
        """Rebuild the mapping from the dictionary; raises `SdoAbort` like a write of it."""
        self.mapping = self._mapping_of(self._count()) if self.exists else Mapping(())

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse a parameter that breaks the rules at the top of this module."""
        if entry.index == self._mapping:
            self._check_mapping(entry, value)
        elif entry.subindex == COB_ID:
            cob_id.check_change(entry.value, value, extended=self._dictionary.extended_ids)
            if not value & cob_id.INVALID:
                self._mapping_of(self._count())
        elif entry.subindex == TRANSMISSION_TYPE:
            if value not in (RPDO_TYPES if self.receive else TPDO_TYPES):
                raise SdoAbort(AbortCode.INVALID_VALUE)
        elif entry.subindex in (INHIBIT_TIME, SYNC_START) and self.exists:
            raise SdoAbort(AbortCode.INVALID_VALUE)

    def changed(self, entry: Entry) -> None:
        """Put an accepted change into force."""
        self.load()
        self.on_change()

    def _check_mapping(self, entry: Entry, value: int) -> None:
        if self.exists or (entry.subindex != 0 and self._count() != 0):
            raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
        if entry.subindex == 0:
            self._mapping_of(value)
        elif value != 0:
            resolve(self._dictionary, value, receive=self.receive)

    def _mapping_of(self, count: int) -> Mapping:
        words = [self._dictionary.get(self._mapping, n) for n in range(1, count + 1)]
        if None in words:
            raise SdoAbort(AbortCode.PDO_LENGTH_EXCEEDED)
        return Mapping(
            [
                resolve(self._dictionary, word.value, receive=self.receive)
                for word in words
                if word is not None
            ]
        )

    def _count(self) -> int:
        entry = self._dictionary.get(self._mapping, 0)
        return 0 if entry is None else int(entry.value)

    def _value(self, subindex: int, missing: int) -> int:
        entry = self._dictionary.get(self._communication, subindex)
        return missing if entry is None else int(entry.value)


def numbers(dictionary: Dictionary, *, receive: bool) -> Iterable[int]:
    """Return the numbers of the PDOs a dictionary describes, 1 for RPDO1 or TPDO1."""
    first = RPDO_COMMUNICATION if receive else TPDO_COMMUNICATION
    return [n + 1 for n in range(MAX_PDOS) if first + n in dictionary]
