"""SYNC: consumer and producer.

CiA 301 7.2.5, 7.5.2.5 to 7.5.2.7 and 7.5.2.22.
"""

from collections.abc import Callable, Sequence
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.abort import AbortCode, SdoAbort
from hil_emulator.device.deadline import NEVER, NOW
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.emergency import Emergency, ErrorBit, ErrorCode
from hil_emulator.device.entry import Entry
from hil_emulator.device.rpdo import Handler
from hil_emulator.device.tpdo import ALWAYS, Tpdo
from hil_emulator.frame import Frame

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
        emergency: reports a SYNC of the wrong length (0x8240).
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

    quiet_until_ns = NEVER  # SYNC is handled on the fast path as well

    @property
    def can_id(self) -> int | None:
        """The identifier of SYNC, or None if the node does not consume SYNC."""
        return None if self._cob_id is None else self._cob_id.value & cob_id.CAN_ID_MASK

    @property
    def window_ns(self) -> int:
        """Time after a SYNC in which a synchronous RPDO is accepted; 0 is unlimited."""
        return 0 if self._window is None else self._window.value * NS_PER_US

    def handler(
        self, tpdos: Sequence[Tpdo] = (), take: Callable[[int, int], None] | None = None
    ) -> Handler:
        """Return the handler of SYNC.

        Args:
            tpdos: TPDOs that are sent at every SYNC.
            take: called with the time and the counter (0 without a counter) for all other PDOs.

        """
        emergency, overflow = self._emergency, self._overflow

        def handle(now_ns: int, data: bytes) -> None:
            counter = 0
            if data or emergency.active or (overflow and overflow.value):
                accepted = self.accept(data)
                if accepted is None:
                    return
                counter = accepted
            for tpdo in tpdos:  # as `Tpdo.sync`: this is part of most ticks
                tpdo.requests += 1
                tpdo.wakes_ns = ALWAYS
            if take:
                take(now_ns, counter)

        return handle

    def accept(self, data: bytes) -> int | None:
        """Return the counter of a SYNC (0 without a counter), or None for a wrong length."""
        overflow = self._overflow
        if len(data) != (overflow is not None and overflow.value != 0):
            self._emergency.raise_error(
                _LENGTH_ERROR, ErrorCode.SYNC_LENGTH, ErrorBit.COMMUNICATION
            )
            return None
        if self._emergency.active:
            self._emergency.clear(_LENGTH_ERROR)
        return data[0] if data else 0

    def check(self, entry: Entry, value: Any) -> None:
        """Refuse values that CiA 301 7.5.2.5 and 7.5.2.22 do not allow.

        Bad identifiers, another identifier while the node produces SYNC, producing it without a
        cycle period object, and a counter of 1 or above 240 are 0609 0030; a change of the
        counter while 0x1006 is not 0 is 0800 0022.
        """
        if entry.index == SYNC_COUNTER_OVERFLOW:
            if self._period is not None and self._period.value != 0:
                raise SdoAbort(AbortCode.WRONG_DEVICE_STATE)
            if value not in _COUNTER_VALUES:
                raise SdoAbort(AbortCode.INVALID_VALUE)
            return
        moved = (entry.value ^ value) & cob_id.CAN_ID_MASK
        if moved and entry.value & value & cob_id.PRODUCER:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if value & cob_id.PRODUCER and self._period is None:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        cob_id.check_can_id(value)

    def changed(self, entry: Entry) -> None:
        """Rebuild the routes for the new identifier."""
        self._on_change()


class SyncProducer:
    """Sends SYNC while bit 30 of 0x1005 is set and the cycle period 0x1006 is not 0.

    The period is in us and never drifts; one that is shorter than a tick gives a SYNC per tick.
    The counter begins with 1 whenever producing begins.

    Args:
        dictionary: the node's dictionary.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._cob_id = dictionary.get(SYNC_COB_ID)
        self._period = dictionary.get(COMMUNICATION_CYCLE_PERIOD)
        self._overflow = dictionary.get(SYNC_COUNTER_OVERFLOW)
        self._running_ns = 0  # the period in force, 0 while SYNC is not produced
        self._next_ns = 0
        self._counter = 0

    @property
    def produces(self) -> bool:
        """Whether bit 30 of 0x1005 is set."""
        return self._cob_id is not None and bool(self._cob_id.value & cob_id.PRODUCER)

    @property
    def quiet_until_ns(self) -> int:
        """See `fast_path`: a producer reads its period in each tick, and once after its end."""
        return NOW if self.produces or self._running_ns else NEVER

    def reset(self) -> None:
        """Restart, after a reset and on leaving STOPPED."""
        self._running_ns = 0

    def due(self, now_ns: int) -> Frame | None:
        """Return SYNC if it is due, else None."""
        period_ns = self._period_ns()
        if period_ns != self._running_ns:
            self._running_ns = period_ns
            self._next_ns = now_ns + period_ns
            self._counter = 0
            return None
        if not period_ns or now_ns < self._next_ns:
            return None
        self._next_ns += ((now_ns - self._next_ns) // period_ns + 1) * period_ns
        assert self._cob_id is not None  # the period is 0 without it
        return Frame(self._cob_id.value & cob_id.CAN_ID_MASK, self._data())

    def _period_ns(self) -> int:
        if self._cob_id is None or self._period is None:
            return 0
        return self._period.value * NS_PER_US if self._cob_id.value & cob_id.PRODUCER else 0

    def _data(self) -> bytes:
        overflow = 0 if self._overflow is None else self._overflow.value
        if not overflow:
            return b""
        self._counter = self._counter % overflow + 1
        return bytes([self._counter])
