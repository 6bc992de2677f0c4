"""EMCY producer, error register and error history (CiA 301 7.2.7, 7.5.2.2, 7.5.2.4).

An error is a condition with a key. Raising it sends one EMCY and sets its bit in 0x1001; clearing
it clears the bit. When the last error is cleared the error reset, code 0000, is sent. While others
are active, clearing an error sends no message (optional in CiA 301), because a stock master reads
code 0000 as "no error".
"""

from collections import deque
from collections.abc import Callable, Hashable
from enum import IntEnum, IntFlag
from typing import Any, NamedTuple

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.frame import Frame

EMCY_BASE = 0x080
"""Predefined connection set: plus the node-ID."""
ERROR_REGISTER = 0x1001
ERROR_HISTORY = 0x1003
EMCY_COB_ID = 0x1014
EMCY_INHIBIT_TIME = 0x1015

NS_PER_100_US = 100_000
QUEUE_LENGTH = 64
"""Messages queued during the inhibit time or in STOPPED; the oldest are dropped (assumed)."""


class ErrorCode(IntEnum):
    """Emergency error codes (CiA 301 7.2.7.1)."""

    NONE = 0x0000
    INTERNAL_SOFTWARE = 0x6100
    CAN_OVERRUN = 0x8110
    ERROR_PASSIVE = 0x8120
    LIFE_GUARD_OR_HEARTBEAT = 0x8130
    RECOVERED_FROM_BUS_OFF = 0x8140
    PDO_TOO_SHORT = 0x8210
    PDO_TOO_LONG = 0x8220
    SYNC_LENGTH = 0x8240
    RPDO_TIMEOUT = 0x8250
    SENSOR_OVERRANGE = 0xFF10
    """Device-specific: plus the channel's position. First manufacturer byte: the position,
    second: 01 above, FF below the range."""


class ErrorBit(IntFlag):
    """Error register (CiA 301 7.5.2.2)."""

    GENERIC = 0x01
    CURRENT = 0x02
    COMMUNICATION = 0x10
    PROFILE = 0x20
    MANUFACTURER = 0x80


class _Error(NamedTuple):
    code: int
    bit: int
    details: bytes


class Emergency:
    """Active errors, their messages and their history.

    Attributes:
        active: errors that have been raised and not been cleared, by their keys.
        queue: messages that have not been sent yet.
        before_error: called before a new error is raised.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        self.before_error: Callable[[], None] = lambda: None
        self._dictionary = dictionary
        self._register = dictionary.entry(ERROR_REGISTER)
        self._cob_id = dictionary.get(EMCY_COB_ID)
        self._inhibit = dictionary.get(EMCY_INHIBIT_TIME)
        count = dictionary.get(ERROR_HISTORY)
        fields = [dictionary.get(ERROR_HISTORY, n) for n in range(1, 255)]
        self._history = [field for field in fields if field is not None]
        self._count = count if self._history else None
        for field in self._history:
            field.default = None  # an empty field is read as 0800 0024, no data available
        for index in (ERROR_HISTORY, EMCY_COB_ID):
            dictionary.watch(index, self)
        self.reset()

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: while an error is active, each tick checks for its end."""
        return NOW if self.active or self.queue else NEVER

    def reset(self) -> None:
        """Clear all errors after an NMT reset. A condition that persists is raised again."""
        self.active: dict[Hashable, _Error] = {}
        self.queue: deque[bytes] = deque(maxlen=QUEUE_LENGTH)
        self._free_ns = 0
        self._register.value = 0
        self._clear_history()

    def raise_error(self, key: Hashable, code: int, bit: ErrorBit, details: bytes = b"") -> None:
        """Report a condition; a repeated report of an active condition has no effect.

        Args:
            key: names the condition until it is cleared.
            code: emergency error code.
            bit: its bit in the error register, besides the generic one.
            details: up to five manufacturer-specific bytes.

        """
        error = _Error(code, bit | ErrorBit.GENERIC, details)
        if self.active.get(key) == error:
            return
        self.before_error()
        self.active[key] = error
        self._update_register()
        self._record(error)
        self._send(code, details)

    def clear(self, key: Hashable) -> None:
        """Report the end of a condition."""
        if self.active.pop(key, None) is None:
            return
        self._update_register()
        if not self.active:
            self._send(ErrorCode.NONE, b"")

    def publish(self, now_ns: int, frames: list[Frame]) -> None:
        """Append the messages that may be sent now."""
        while self.queue and now_ns >= self._free_ns:
            message = self.queue.popleft()
            predefined = EMCY_BASE + self._dictionary.node_id
            number = predefined if self._cob_id is None else self._cob_id.value
            if number & cob_id.INVALID:
                continue
            frames.append(Frame(number & cob_id.CAN_ID_MASK, message))
            if self._inhibit is not None:
                self._free_ns = now_ns + self._inhibit.value * NS_PER_100_US

    def check(self, entry: Entry, value: Any) -> None:
        """Accept only 0 for the history's counter; lock the COB-ID while EMCY exists."""
        if entry.index == EMCY_COB_ID:
            cob_id.check_change(entry.value, value)
        elif value != 0:
            raise SdoAbort(AbortCode.INVALID_VALUE)

    def changed(self, entry: Entry) -> None:
        """Empty the history when its counter is set to 0."""
        if entry.index == ERROR_HISTORY:
            self._clear_history()

    def _send(self, code: int, details: bytes) -> None:
        head = code.to_bytes(2, "little") + bytes([self._register.value])
        self.queue.append((head + details).ljust(8, b"\0"))

    def _update_register(self) -> None:
        register = 0
        for error in self.active.values():
            register |= error.bit
        self._register.value = register

    def _record(self, error: _Error) -> None:
        """Put the newest error in front: code, and two manufacturer bytes above it."""
        if self._count is None:
            return
        newest = error.code | int.from_bytes(error.details[:2], "little") << 16
        values = [newest, *(field.value for field in self._history)]
        for field, value in zip(self._history, values, strict=False):
            field.value = value
        self._count.value = min(self._count.value + 1, len(self._history))

    def _clear_history(self) -> None:
        if self._count is not None:
            self._count.value = 0
        for field in self._history:
            field.value = field.default
