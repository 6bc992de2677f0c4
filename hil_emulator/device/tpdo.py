"""TPDO: samples from the dictionary onto the bus (CiA 301 7.2.2).

| type | sent |
|---|---|
| 0 | at a SYNC, if the data changed since it was last sent |
| 1 to 240 | at every n-th SYNC |
| 252 | on a remote frame, with the data of the last SYNC |
| 253 | on a remote frame, with the present data |
| 254, 255 | when the event timer elapses; without one, when the data changed |

The event of 254 (manufacturer-specific) and 255 (device profile) is the same here. With an event
timer, a change of a sampled signal is not an event, because analogue data change in each sample. If
a trigger monitors a mapped object for a delta or for limits, it decides which changes of the object
are events, with and without an event timer.
"""

from collections.abc import Sequence
from typing import Any

from hil_emulator.device import cob_id
from hil_emulator.device.deadline import NEVER
from hil_emulator.device.entry import Entry
from hil_emulator.device.pdo import (
    EVENT_MANUFACTURER,
    RTR_EVENT,
    RTR_SYNC,
    SYNC_ACYCLIC,
    SYNC_CYCLIC_MAX,
    PdoParameters,
)
from hil_emulator.device.rpdo import NS_PER_MS
from hil_emulator.frame import Frame

NS_PER_US = 1_000
UNSTARTED = ALWAYS = -1
"""In place of the time of the next event: the timer has not started; or the time has passed."""


class Tpdo:
    """One transmit PDO: decides each tick whether it is due, and packs it.

    Args:
        parameters: the PDO's records.

    Attributes:
        wakes_ns: time before which `publish` sends nothing.
        next_ns: when its event timer elapses, `NEVER` without one.
        period_ns: of its event timer, 0 without one.
        requests: transmissions due now, regardless of the inhibit time.

    """

    def __init__(self, parameters: PdoParameters) -> None:
        self.parameters = parameters
        self.start()

    def start(self) -> None:
        """Restart, on entering OPERATIONAL and after a change of parameters."""
        parameters = self.parameters
        self._can_id = parameters.can_id
        self._extended = parameters.extended
        self._mapping = parameters.mapping
        self._type = kind = parameters.transmission_type
        self.requests = 0
        self._event = False  # an event waiting for the inhibit time
        self._syncs_left = kind
        self._sync_start = parameters.sync_start
        self._sync_pending = False
        self._sampled: bytes | None = None
        self._last: bytes | None = None
        self._ungated: list[Any] | None = None
        self._inhibit_ns = parameters.inhibit_us * NS_PER_US
        self._free_ns = 0
        event_driven = kind >= EVENT_MANUFACTURER
        self.period_ns = parameters.event_timer_ms * NS_PER_MS if event_driven else 0
        self.next_ns = UNSTARTED if self.period_ns else NEVER
        self._on_change = event_driven and not self.period_ns
        self.wakes_ns = ALWAYS if self._on_change else self.next_ns

    def sync(self, counter: int) -> None:
        """Register a SYNC; the next `publish` sends the triggered transmission.

        Args:
            counter: the SYNC's counter, 0 without a counter. The first SYNC that counts has the
                start value (sub-index 6) as its counter (CiA 301 7.5.2.37).

        """
        if counter and self._sync_start:
            if counter != self._sync_start:
                return
            self._sync_start = 0
            self._syncs_left = 1
        if SYNC_ACYCLIC < self._type <= SYNC_CYCLIC_MAX:
            self._syncs_left -= 1
            if self._syncs_left == 0:
                self._syncs_left = self._type
                self.requests += 1
                self.wakes_ns = ALWAYS
        elif self._type in (SYNC_ACYCLIC, RTR_SYNC):
            self._sync_pending = True
            self.wakes_ns = ALWAYS

    def request(self) -> None:
        """Register a remote frame, unless the COB-ID excludes RTR."""
        if not self.parameters.cob_id & cob_id.NO_RTR:
            self.requests += 1
            self.wakes_ns = ALWAYS

    @property
    def at_every_sync(self) -> bool:
        """Whether every SYNC triggers it, regardless of the counter."""
        return self.parameters.transmission_type == 1 and not self.parameters.sync_start

    @property
    def repeats(self) -> bool:
        """Whether only event timer or SYNC trigger it, and no event is pending."""
        if self._event:
            return False
        if self.period_ns:
            return self.next_ns != UNSTARTED and not self._inhibit_ns
        return SYNC_ACYCLIC < self._type <= SYNC_CYCLIC_MAX or self._type == RTR_EVENT

    def trigger(self, entries: Sequence[Entry]) -> None:
        """Register an event of some objects, if one of them is mapped in this PDO."""
        if self._type >= EVENT_MANUFACTURER and any(e in entries for e in self._mapping.entries):
            self._event = True
            self.wakes_ns = ALWAYS

    def publish(self, now_ns: int, frames: list[Frame]) -> None:
        """Append this PDO as often as it is due."""
        due_ns = self.next_ns
        if due_ns == UNSTARTED:
            self.next_ns = now_ns + self.period_ns
        elif now_ns >= due_ns:
            self._event = True
            self.skip_elapsed(now_ns)
        if self._on_change and self._changed():
            self._event = True
        if self._event and now_ns >= self._free_ns:
            self._event = False
            self._free_ns = now_ns + self._inhibit_ns
            self.requests += 1
        if self._sync_pending:
            self._at_sync()
        if self.requests:
            self._send(frames)
        # a pending event checks the inhibit time in every tick
        self.wakes_ns = ALWAYS if self._on_change or self._event else self.next_ns

    def skip_elapsed(self, now_ns: int) -> None:
        """Set the event timer to its next multiple after now: no drift, at most once per tick."""
        self.next_ns += ((now_ns - self.next_ns) // self.period_ns + 1) * self.period_ns

    def _changed(self) -> bool:
        """Return whether an object without a trigger has changed."""
        entries = self._mapping.entries
        if not any(entry.gated for entry in entries):
            return self._mapping.pack() != self._last
        ungated = [entry.value for entry in entries if not entry.gated]
        changed, self._ungated = ungated != self._ungated, ungated
        return changed

    def _at_sync(self) -> None:
        self._sync_pending = False
        data = self._mapping.pack()
        if self._type == SYNC_ACYCLIC and data != self._last:
            self.requests += 1
        self._sampled = data

    def _send(self, frames: list[Frame]) -> None:
        data = self._mapping.pack()
        if self._type == RTR_SYNC and self._sampled is not None:
            data = self._sampled
        self._last = data
        frame = Frame(self._can_id, data, False, self._extended)
        for _ in range(self.requests):
            frames.append(frame)
        self.requests = 0
