"""When the next tick may begin: at once, at its time on the wall, or when a SYNC has come.

All clocks have one method, `wait_until(t_ns) -> lateness_ns`, where `t_ns` is the emulator's own
time; nothing else in the emulator looks at a clock.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

from hil_emulator.frame import Frame

SYNC_ID = 0x080
"""Default COB-ID of the SYNC message (CiA 301 7.3.5)."""


class Clock(Protocol):
    """What the loop asks before each tick.

    Attributes:
        slipped_ns: by how much emulator time has fallen behind the wall in all.

    """

    slipped_ns: int

    def wait_until(self, t_ns: int) -> int:
        """Return when emulator time `t_ns` may begin; say by how much that is late [ns]."""
        ...


class LockStep:
    """No waiting: the emulator's time is the only time, as fast as the machine can."""

    slipped_ns = 0

    def wait_until(self, t_ns: int) -> int:
        """Return at once."""
        return 0


AWAKE = 1e-4
"""What is not slept of a wait [s]: a sleeper wakes up later than it asked for, by 30 us as a rule,
by 50 to 100 us once in a hundred times under SCHED_FIFO (`cyclictest`)."""


def sleep_punctually(seconds: float) -> None:
    """Let some seconds pass, the last of them awake: nothing else wakes up to the microsecond."""
    end = time.perf_counter() + seconds
    if seconds > AWAKE:
        time.sleep(seconds - AWAKE)
    while time.perf_counter() < end:
        pass


class WallClock:
    """Real time, by absolute deadlines, so that delays do not add up.

    A tick that begins late by a whole period or more moves the later deadlines with it: no tick
    is skipped, and none follows the other in a burst.

    Args:
        period_ns: distance of the ticks [ns].
        now: monotonic time [ns].
        sleep: waits for some seconds.

    Attributes:
        slipped_ns: by how much emulator time has fallen behind the wall in all.

    """

    def __init__(
        self,
        period_ns: int,
        now: Callable[[], int] = time.perf_counter_ns,
        sleep: Callable[[float], None] = sleep_punctually,
    ) -> None:
        self._period_ns = period_ns
        self._now = now
        self._sleep = sleep
        self._origin_ns: int | None = None
        self.slipped_ns = 0

    def wait_until(self, t_ns: int) -> int:
        """Sleep until the wall shows `t_ns` since the first call."""
        if self._origin_ns is None:
            self._origin_ns = self._now() - t_ns
        remaining = self._origin_ns + t_ns - self._now()
        if remaining > 0:
            self._sleep(remaining * 1e-9)
            remaining = self._origin_ns + t_ns - self._now()
        lateness = max(0, -remaining)
        if lateness >= self._period_ns:
            self._origin_ns += lateness
            self.slipped_ns += lateness
        return lateness


class WaitingBus(Protocol):
    """The bus as the follow-SYNC clock sees it."""

    def receive(self) -> list[Frame]:
        """Return what has arrived, never wait."""
        ...

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames, never wait."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait until something arrives, at most `timeout` [s]."""
        ...

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus."""
        ...


class FollowSync:
    """The controller's SYNC messages are the clock: each lets one SYNC period pass.

    Stands between the bus and the rig, so that every SYNC reaches the nodes in the tick that it
    releases. While time stands still, other frames are served at the present moment: a master can
    configure the node before it starts to send SYNC.

    Args:
        bus: where the SYNC messages come from.
        sync_period_ns: emulator time that one SYNC stands for [ns].

    Attributes:
        serve: lets the nodes answer frames without moving the plant; set by whoever has the rig.
        idle: called some times a second while no SYNC comes.

    """

    slipped_ns = 0

    def __init__(self, bus: WaitingBus, sync_period_ns: int) -> None:
        self._bus = bus
        self._period_ns = sync_period_ns
        self._released_ns = 0
        self._waiting: list[Frame] = []
        self._passed: list[Frame] = []
        self.serve: Callable[[Sequence[Frame]], None] = lambda frames: None
        self.idle: Callable[[], None] = lambda: None
        self.send = bus.send

    def wait_until(self, t_ns: int) -> int:
        """Return once so many SYNC messages have come that `t_ns` may begin."""
        while t_ns >= self._released_ns:
            before = self._until_sync()
            if before:
                self.serve(before)
            if self._waiting:
                self._passed = [self._waiting.pop(0)]
                self._released_ns += self._period_ns
            elif not before:
                self._bus.wait(0.1)
                self.idle()
        return 0

    def receive(self) -> list[Frame]:
        """Return the SYNC that released this tick and what came with it."""
        passed, self._passed = self._passed, []
        return passed + self._until_sync()

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus."""
        self._bus.report(error_class)

    def _until_sync(self) -> list[Frame]:
        """Take what has arrived up to, and without, the next SYNC."""
        if not self._waiting:
            self._waiting = self._bus.receive()
        frames = self._waiting
        at = next((i for i, f in enumerate(frames) if f.can_id == SYNC_ID), len(frames))
        self._waiting = frames[at:]
        return frames[:at]
