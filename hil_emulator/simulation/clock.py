"""Clocks, which decide when the next tick begins: at once, in real time, or after a SYNC.

All clocks have one method, `wait_until(t_ns) -> lateness_ns`, where `t_ns` is emulator time. No
other part of the emulator reads a clock.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

from hil_emulator.frame import Frame

SYNC_ID = 0x080
"""Default COB-ID of the SYNC message (CiA 301 7.3.5)."""


class Clock(Protocol):
    """The interface of clocks.

    Attributes:
        slipped_ns: total delay of emulator time behind real time.

    """

    slipped_ns: int

    def wait_until(self, t_ns: int) -> int:
        """Wait until emulator time `t_ns` may begin; return the delay [ns]."""
        ...


class LockStep:
    """Lock-step: does not wait."""

    slipped_ns = 0

    def wait_until(self, t_ns: int) -> int:
        """Return at once."""
        return 0


AWAKE = 1e-4
"""Part of a wait with busy waiting, at its end [s]. A sleeping process wakes up late, usually by
30 us, and by 50 to 100 us in 1 % of cases under SCHED_FIFO (`cyclictest`)."""


def sleep_punctually(seconds: float) -> None:
    """Wait for some seconds, with busy waiting at the end, for a precision of 1 us."""
    end = time.perf_counter() + seconds
    if seconds > AWAKE:
        time.sleep(seconds - AWAKE)
    while time.perf_counter() < end:
        pass


class WallClock:
    """Real time, by absolute deadlines, so that delays do not add up.

    A tick that begins late by a period or more also delays the later deadlines: no tick is skipped,
    and there is no burst of ticks.

    Args:
        period_ns: period of the ticks [ns].
        now: monotonic time [ns].
        sleep: waits for some seconds.

    Attributes:
        slipped_ns: total delay of emulator time behind real time.

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
        """Wait until `t_ns` of real time since the first call."""
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
    """Interface of the bus for the follow-SYNC clock."""

    def receive(self) -> list[Frame]:
        """Return the arrived frames without waiting."""
        ...

    def send(self, frames: Iterable[Frame]) -> None:
        """Send frames without waiting."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait until a frame arrives, at most `timeout` [s]."""
        ...

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus."""
        ...


class FollowSync:
    """Clock by the controller's SYNC messages: each SYNC advances the time by a SYNC period.

    It is placed between the bus and the rig, so that every SYNC reaches the nodes in the tick that
    it releases. While time is stopped, other frames are served at the present time: a master can
    configure the node before it sends SYNC.

    Args:
        bus: of the SYNC messages.
        sync_period_ns: emulator time per SYNC [ns].

    Attributes:
        serve: makes the nodes answer frames without a step of the plant; set by the rig's owner.
        idle: called several times a second while no SYNC arrives.

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
        """Return when enough SYNC messages have arrived for `t_ns` to begin."""
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
        """Return the SYNC that released this tick, and the frames that came with it."""
        passed, self._passed = self._passed, []
        return passed + self._until_sync()

    def report(self, error_class: int) -> None:
        """Show an error frame to the others on the bus."""
        self._bus.report(error_class)

    def _until_sync(self) -> list[Frame]:
        """Collect the arrived frames up to, and without, the next SYNC."""
        if not self._waiting:
            self._waiting = self._bus.receive()
        frames = self._waiting
        at = next((i for i, f in enumerate(frames) if f.can_id == SYNC_ID), len(frames))
        self._waiting = frames[at:]
        return frames[:at]
