"""TIME: the network's time of day (CiA 301 7.2.6).

As a consumer the node only shows the last TIME message received, in the object `network_time`. As a
producer it sends the time since it was switched on, starting at 1 January 1984 or at the last TIME
message received.
"""

from collections.abc import Callable
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.frame import Frame

TIME_COB_ID = 0x1012
CONSUMER = 1 << 31
NETWORK_TIME = "network_time"
"""ParameterName of the object, of type TIME_OF_DAY: ms since midnight, days since 1984."""

_LENGTH = 6
_RESERVED = 0xF000_0000
"""Upper bits of the milliseconds, which are void (CiA 301 7.4.7.1)."""


PERIOD_NS = 1_000_000_000
"""Period of TIME messages; CiA 301 does not define it (assumed)."""
NS_PER_MS = 1_000_000
MS_PER_DAY = 86_400_000
DAYS_SHIFT = 32
"""Position of the days since 1984, above the milliseconds of the day (CiA 301 7.4.7.1)."""
UNSTARTED = -1
_MILLISECONDS = 0x0FFF_FFFF


class TimeStamp:
    """Consumes TIME while bit 31 of 0x1012 is set, and produces TIME while bit 30 is set.

    Args:
        dictionary: the node's dictionary.
        on_change: called after the COB-ID has changed.

    """

    def __init__(self, dictionary: Dictionary, on_change: Callable[[], None]) -> None:
        self._cob_id = dictionary.get(TIME_COB_ID)
        self._shown = dictionary.named(NETWORK_TIME)
        self._on_change = on_change
        self._heard_ns = 0
        self._heard_ms = 0
        self._next_ns = UNSTARTED
        dictionary.watch(TIME_COB_ID, self)

    @property
    def can_id(self) -> int | None:
        """The identifier of TIME, or None if the node does not consume TIME."""
        if self._cob_id is None or not self._cob_id.value & CONSUMER:
            return None
        return int(self._cob_id.value) & cob_id.CAN_ID_MASK

    @property
    def produces(self) -> bool:
        """Whether bit 30 of 0x1012 is set."""
        return self._cob_id is not None and bool(self._cob_id.value & cob_id.PRODUCER)

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: a producer reads its COB-ID in each tick, and once after its end."""
        return NOW if self.produces or self._next_ns != UNSTARTED else NEVER

    def reset(self) -> None:
        """Start a new period after a reset."""
        self._next_ns = UNSTARTED

    def due(self, now_ns: int) -> Frame | None:
        """Return the TIME to send now, once a second while bit 30 of 0x1012 is set."""
        if self._cob_id is None or not self._cob_id.value & cob_id.PRODUCER:
            self._next_ns = UNSTARTED
            return None
        if self._next_ns == UNSTARTED:
            self._next_ns = now_ns + PERIOD_NS
        if now_ns < self._next_ns:
            return None
        self._next_ns += ((now_ns - self._next_ns) // PERIOD_NS + 1) * PERIOD_NS
        elapsed_ms = self._heard_ms + (now_ns - self._heard_ns) // NS_PER_MS
        days, milliseconds = divmod(elapsed_ms, MS_PER_DAY)
        data = (days << DAYS_SHIFT | milliseconds).to_bytes(_LENGTH, "little")
        return Frame(self._cob_id.value & cob_id.CAN_ID_MASK, data)

    def receive(self, now_ns: int, data: bytes) -> None:
        """Handle a message; a frame of another length is not TIME."""
        if len(data) != _LENGTH:
            return
        value = int.from_bytes(data, "little") & ~_RESERVED
        self._heard_ns = now_ns
        self._heard_ms = (value >> DAYS_SHIFT) * MS_PER_DAY + (value & _MILLISECONDS)
        if self._shown is not None:
            self._shown.value = value

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse bad identifiers, and a change while the node produces TIME (0609 0030)."""
        moved = (entry.value ^ value) & cob_id.CAN_ID_MASK
        if moved and entry.value & value & cob_id.PRODUCER:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        cob_id.check_can_id(value)

    def changed(self, entry: Entry) -> None:
        """Rebuild the routes for the new identifier."""
        self._on_change()
