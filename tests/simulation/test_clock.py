"""The clocks, which decide when a tick begins."""

import itertools
import time
from collections import deque
from collections.abc import Iterable, Sequence

import pytest

from hil_emulator.frame import Frame
from hil_emulator.simulation.clock import (
    AWAKE,
    SYNC_ID,
    FollowSync,
    LockStep,
    WallClock,
    sleep_punctually,
)

MS = 1_000_000


class Wall:
    """A simulated wall clock: time passes in `sleep`, and when the test advances it."""

    def __init__(self) -> None:
        self.ns = 5_000 * MS
        self.oversleeps_ns = 0

    def now(self) -> int:
        """Return the time."""
        return self.ns

    def sleep(self, seconds: float) -> None:
        """Advance the time, and by a little more."""
        self.ns += round(seconds * 1e9) + self.oversleeps_ns


def clock_on(wall: Wall) -> WallClock:
    """Return a clock with ticks of 1 ms on a simulated wall clock."""
    return WallClock(MS, now=wall.now, sleep=wall.sleep)


def test_lock_step_never_waits() -> None:
    """In lock-step every tick begins at once, without delay."""
    clock = LockStep()
    assert [clock.wait_until(t * MS) for t in (0, 1, 1_000_000)] == [0, 0, 0]


def test_wall_clock_deadlines_are_absolute() -> None:
    """A wait that is 50 us too long each time gives 50 us of lateness, not a drift."""
    wall = Wall()
    wall.oversleeps_ns = 50_000
    clock = clock_on(wall)
    start = wall.ns
    lateness = [clock.wait_until(k * MS) for k in range(1000)]
    assert lateness[1:] == [50_000] * 999
    assert wall.ns - start == 999 * MS + 50_000
    assert clock.slipped_ns == 0


@pytest.mark.parametrize("seconds", [0.0, 0.5 * AWAKE, 5.0 * AWAKE])
def test_a_wait_never_ends_early(seconds: float) -> None:
    """At the end of a wait the requested time has passed, with sleep or busy waiting."""
    begin = time.perf_counter()
    sleep_punctually(seconds)
    assert time.perf_counter() - begin >= seconds


def test_a_little_delay_is_made_up() -> None:
    """After a tick of 1.4 periods the next tick begins 0.4 periods late, the one after in time."""
    wall = Wall()
    clock = clock_on(wall)
    clock.wait_until(0)
    wall.ns += 1_400_000
    assert clock.wait_until(MS) == 400_000
    assert clock.wait_until(2 * MS) == 0


def test_a_long_stall_causes_no_burst() -> None:
    """After a stall of ten periods the ticks continue at their period, and no tick is skipped."""
    wall = Wall()
    clock = clock_on(wall)
    clock.wait_until(0)
    wall.ns += 10 * MS
    assert clock.wait_until(MS) == 9 * MS
    begins = []
    for k in range(2, 6):
        assert clock.wait_until(k * MS) == 0
        begins.append(wall.ns)
    assert [b - a for a, b in itertools.pairwise(begins)] == [MS] * 3
    assert clock.slipped_ns == 9 * MS


class ScriptedBus:
    """A bus on which one batch of frames arrives in each wait."""

    def __init__(self, batches: Iterable[Sequence[Frame]]) -> None:
        self.batches = deque(batches)
        self.arrived: list[Frame] = []
        self.sent: list[Frame] = []

    def receive(self) -> list[Frame]:
        """Return the frames received."""
        frames, self.arrived = self.arrived, []
        return frames

    def send(self, frames: Iterable[Frame]) -> None:
        """Store the frames sent."""
        self.sent += frames

    def wait(self, timeout: float) -> bool:
        """Make the next batch arrive; the test ends after the last batch."""
        if not self.batches:
            raise TimeoutError
        self.arrived += self.batches.popleft()
        return True


SYNC = Frame(SYNC_ID)
SDO = Frame(0x605, bytes(8))
SET_POINT = Frame(0x205, bytes(4))


def test_each_sync_lets_one_period_pass() -> None:
    """Three SYNC messages of 2 ms release six ticks of 1 ms, not seven."""
    clock = FollowSync(ScriptedBus([[SYNC], [SYNC, SYNC]]), 2 * MS)
    for k in range(6):
        assert clock.wait_until(k * MS) == 0
    with pytest.raises(TimeoutError):
        clock.wait_until(6 * MS)


def test_a_sync_reaches_the_tick_it_releases() -> None:
    """SYNC messages that arrive together are passed one per tick, with the frames before them."""
    clock = FollowSync(ScriptedBus([[SYNC, SET_POINT, SYNC]]), MS)
    clock.wait_until(0)
    assert clock.receive() == [SYNC, SET_POINT]
    clock.wait_until(MS)
    assert clock.receive() == [SYNC]


def test_a_master_is_served_while_time_is_stopped() -> None:
    """Before the first SYNC other frames are answered, so that the node can be configured."""
    served: list[Frame] = []
    clock = FollowSync(ScriptedBus([[SDO], [SDO, SYNC]]), MS)
    clock.serve = served.extend
    clock.wait_until(0)
    assert served == [SDO, SDO]
    assert clock.receive() == [SYNC]
