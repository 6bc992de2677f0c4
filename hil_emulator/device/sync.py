"""SYNC consumer: which frame is the SYNC, and is it well formed (CiA 301 7.2.5)."""

from collections.abc import Callable
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.entry import Entry

SYNC_COB_ID = 0x1005
COMMUNICATION_CYCLE_PERIOD = 0x1006
SYNCHRONOUS_WINDOW_LENGTH = 0x1007
SYNC_COUNTER_OVERFLOW = 0x1019

NS_PER_US = 1_000
_COUNTER_VALUES = frozenset({0, *range(2, 241)})
_LENGTH_ERROR = "SYNC length"


class SyncConsumer:
    """The node's view of SYNC.

    Args:
        dictionary: 0x1005 is the COB-ID (without it the node consumes no SYNC), 0x1019 not 0
            where SYNC carries a counter, 0x1007 the window for synchronous RPDOs in us.
        emergency: told of a SYNC of the wrong length (0x8240).
        on_change: called after the COB-ID has changed.

    """

    def __init__(
        self, dictionary: Dictionary, emergency: Emergency, on_change: Callable[[], None]
    ) -> None:
        self._cob_id = dictionary.get(SYNC_COB_ID)
        self._overflow = dictionary.get(SYNC_COUNTER_OVERFLOW)
        self._window = dictionary.get(SYNCHRONOUS_WINDOW_LENGTH)
        self._period = dictionary.get(COMMUNICATION_CYCLE_PERIOD)
        self._emergency = emergency
        self._on_change = on_change
        for index in (SYNC_COB_ID, SYNC_COUNTER_OVERFLOW):
            dictionary.watch(index, self)

    @property
    def can_id(self) -> int | None:
        """The identifier SYNC arrives with, or None where the node consumes none."""
        return None if self._cob_id is None else self._cob_id.value & cob_id.CAN_ID_MASK

    @property
    def window_ns(self) -> int:
        """How long after a SYNC a synchronous RPDO is still taken for the next; 0 is always."""
        return 0 if self._window is None else self._window.value * NS_PER_US

    def accept(self, data: bytes) -> int | None:
        """Return the counter of a SYNC (0 where it has none), or None for a wrong length."""
        counted = self._overflow is not None and self._overflow.value != 0
        if len(data) != counted:
            self._emergency.raise_error(
                _LENGTH_ERROR, ErrorCode.SYNC_LENGTH, ErrorBit.COMMUNICATION
            )
            return None
        self._emergency.clear(_LENGTH_ERROR)
        return data[0] if counted else 0

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse what CiA 301 7.5.2.5 and 7.5.2.22 do not allow.

        Producing SYNC, bad identifiers and a counter of 1 or above 240 are 0609 0030; a change
        of the counter while 0x1006 is not 0 is 0800 0022.
        """
        if entry.index == SYNC_COUNTER_OVERFLOW:
            if self._period is not None and self._period.value != 0:
                raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
            if value not in _COUNTER_VALUES:
                raise SdoAbort(AbortCode.INVALID_VALUE)
            return
        if value & cob_id.PRODUCER:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        cob_id.check_can_id(value)

    def changed(self, entry: Entry) -> None:
        """Listen for the new identifier."""
        self._on_change()
