"""Error control: boot-up and heartbeat (CiA 301 7.2.8.3.2)."""

from typing import Any

from hil_emulator.device.deadline import NEVER
from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.entry import Entry
from hil_emulator.device.nmt import State
from hil_emulator.device.rpdo import NS_PER_MS
from hil_emulator.frame import Frame

PRODUCER_HEARTBEAT_TIME = 0x1017
ERROR_CONTROL_COB_ID = 0x700
UNSTARTED = -1
"""In place of the time of the next heartbeat until the first tick of its period."""


class Heartbeat:
    """Heartbeat producer, period in 0x1017 in ms; 0 is off.

    Boot-up counts as the first heartbeat. After a write of the period the first one is sent at
    once (CiA 301 7.2.8.3.2.2: the protocol begins immediately).

    Attributes:
        due_ns: time before which `publish` sends nothing.

    """

    quiet_until_ns = NEVER  # `PackedTpdos` sends it on the fast path

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        self._time = dictionary.get(PRODUCER_HEARTBEAT_TIME)
        self._period_ns = 0
        self.due_ns = UNSTARTED
        if self._time is not None:
            dictionary.watch(PRODUCER_HEARTBEAT_TIME, self)

    def boot_up(self, now_ns: int) -> Frame:
        """Return the boot-up message and start the period."""
        self._start(now_ns)
        return self._message(State.INITIALISING)

    def publish(self, now_ns: int, state: State, frames: list[Frame]) -> None:
        """Append a heartbeat where one is due."""
        if self.due_ns == UNSTARTED:
            self._start(now_ns)
            if self._period_ns:
                self.due_ns = now_ns
        if now_ns >= self.due_ns:
            frames.append(self._message(state))
            self.due_ns += ((now_ns - self.due_ns) // self._period_ns + 1) * self._period_ns

    def check(self, entry: Entry, value: Any) -> None:
        """Accept any period."""

    def changed(self, entry: Entry) -> None:
        """Start a new period."""
        self.due_ns = UNSTARTED

    def _message(self, state: State) -> Frame:
        return Frame(ERROR_CONTROL_COB_ID + self._dictionary.node_id, bytes([state]))

    def _start(self, now_ns: int) -> None:
        self._period_ns = 0 if self._time is None else self._time.value * NS_PER_MS
        self.due_ns = now_ns + self._period_ns if self._period_ns else NEVER
