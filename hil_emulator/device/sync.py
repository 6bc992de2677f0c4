"""SYNC consumer: which frame is the SYNC, and is it well formed (CiA 301 7.2.5)."""

from collections.abc import Callable
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.entry import Entry

SYNC_COB_ID = 0x1005
DEFAULT_CAN_ID = 0x080

_LENGTH_ERROR = "SYNC length"


class SyncConsumer:
    """The node's view of SYNC.

    Args:
        dictionary: 0x1005 is the COB-ID; without it the node consumes no SYNC.
        emergency: told of a SYNC of the wrong length (0x8240).
        on_change: called after the COB-ID has changed.

    """

    def __init__(
        self, dictionary: Dictionary, emergency: Emergency, on_change: Callable[[], None]
    ) -> None:
        self._cob_id = dictionary.get(SYNC_COB_ID)
        self._emergency = emergency
        self._on_change = on_change
        if self._cob_id is not None:
            dictionary.watch(SYNC_COB_ID, self)

    @property
    def can_id(self) -> int | None:
        """The identifier SYNC arrives with, or None where the node consumes none."""
        return None if self._cob_id is None else self._cob_id.value & cob_id.CAN_ID_MASK

    def accept(self, data: bytes) -> bool:
        """Return whether a frame with the SYNC's identifier is a SYNC (no counter: no data)."""
        if data:
            self._emergency.raise_error(
                _LENGTH_ERROR, ErrorCode.SYNC_LENGTH, ErrorBit.COMMUNICATION
            )
            return False
        self._emergency.clear(_LENGTH_ERROR)
        return True

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse to produce SYNC, and identifiers that are not allowed (0609 0030)."""
        if value & cob_id.PRODUCER:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        cob_id.check_can_id(value)

    def changed(self, entry: Entry) -> None:
        """Listen for the new identifier."""
        self._on_change()
