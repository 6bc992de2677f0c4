"""TIME consumer: the network's time of day (CiA 301 7.2.6).

The node only shows what it is told: its own time is an argument, and the object `network_time`
holds the last TIME message received.
"""

from collections.abc import Callable
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry

TIME_COB_ID = 0x1012
CONSUMER = 1 << 31
NETWORK_TIME = "network_time"
"""ParameterName of the object, of type TIME_OF_DAY: ms since midnight, days since 1984."""

_LENGTH = 6
_RESERVED = 0xF000_0000
"""Upper bits of the milliseconds, which CiA 301 7.4.7.1 leaves void."""


class TimeConsumer:
    """Takes TIME messages while bit 31 of 0x1012 is set.

    Args:
        dictionary: the node's dictionary.
        on_change: called after the COB-ID has changed.

    """

    def __init__(self, dictionary: Dictionary, on_change: Callable[[], None]) -> None:
        self._cob_id = dictionary.get(TIME_COB_ID)
        self._shown = dictionary.named(NETWORK_TIME)
        self._on_change = on_change
        dictionary.watch(TIME_COB_ID, self)

    @property
    def can_id(self) -> int | None:
        """The identifier TIME arrives with, or None where the node consumes none."""
        if self._cob_id is None or not self._cob_id.value & CONSUMER:
            return None
        return int(self._cob_id.value) & cob_id.CAN_ID_MASK

    def receive(self, now_ns: int, data: bytes) -> None:
        """Take a message; one of another length is no TIME."""
        if len(data) == _LENGTH and self._shown is not None:
            self._shown.value = int.from_bytes(data, "little") & ~_RESERVED

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse to produce TIME, and identifiers that are not allowed (0609 0030)."""
        if value & cob_id.PRODUCER:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        cob_id.check_can_id(value)

    def changed(self, entry: Entry) -> None:
        """Listen for the new identifier."""
        self._on_change()
