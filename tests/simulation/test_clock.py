"""The clocks: when a tick may begin."""

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
    """A wall clock of the test's own: time passes in sleep, and when the test says so."""

    def __init__(self) -> None:
        self.ns = 5_000 * MS
        self.oversleeps_ns = 0

    def now(self) -> int:
        """Return the time."""
        return self.ns

    def sleep(self, seconds: float) -> None:
        """Let the time pass, and a little more."""
        self.ns += round(seconds * 1e9) + self.oversleeps_ns


def clock_on(wall: Wall) -> WallClock:
    """Return a clock of 1 ms ticks on a wall."""
    return WallClock(MS, now=wall.now, sleep=wall.sleep)


def test_lock_step_never_waits() -> None:
    """In lock-step any moment may begin at once, and nothing is late."""
    clock = LockStep()
    assert [clock.wait_until(t * MS) for t in (0, 1, 1_000_000)] == [0, 0, 0]


def test_wall_clock_deadlines_are_absolute() -> None:
    """Oversleeping by 50 us every time is 50 us of lateness, not a drift."""
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
    """Asleep or awake, what was asked for has passed."""
    begin = time.perf_counter()
    sleep_punctually(seconds)
    assert time.perf_counter() - begin >= seconds


def test_a_little_delay_is_made_up() -> None:
    """After a tick that took 1.4 periods the next one begins 0.4 late, the one after in time."""
    wall = Wall()
    clock = clock_on(wall)
    clock.wait_until(0)
    wall.ns += 1_400_000
    assert clock.wait_until(MS) == 400_000
    assert clock.wait_until(2 * MS) == 0


def test_a_long_stall_is_no_reason_for_a_burst() -> None:
    """After a stall of ten periods the ticks go on one period apart, none of them skipped."""
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
    """A bus on which batches of frames arrive, one batch each time somebody waits."""

    def __init__(self, batches: Iterable[Sequence[Frame]]) -> None:
        self.batches = deque(batches)
        self.arrived: list[Frame] = []
        self.sent: list[Frame] = []

    def receive(self) -> list[Frame]:
        """Return what has arrived."""
        frames, self.arrived = self.arrived, []
        return frames

    def send(self, frames: Iterable[Frame]) -> None:
        """Keep what is sent."""
        self.sent += frames

    def wait(self, timeout: float) -> bool:
        """Let the next batch arrive; the test ends when there is none."""
        if not self.batches:
            raise TimeoutError
        self.arrived += self.batches.popleft()
        return True


SYNC = Frame(SYNC_ID)
SDO = Frame(0x605, bytes(8))
SET_POINT = Frame(0x205, bytes(4))


def test_each_sync_lets_one_period_pass() -> None:
    """Three SYNC messages of 2 ms let six ticks of 1 ms begin, and no seventh."""
    clock = FollowSync(ScriptedBus([[SYNC], [SYNC, SYNC]]), 2 * MS)
    for k in range(6):
        assert clock.wait_until(k * MS) == 0
    with pytest.raises(TimeoutError):
        clock.wait_until(6 * MS)


def test_a_sync_reaches_the_tick_it_releases() -> None:
    """SYNC messages that arrive together are handed on one per tick, frames before them too."""
    clock = FollowSync(ScriptedBus([[SYNC, SET_POINT, SYNC]]), MS)
    clock.wait_until(0)
    assert clock.receive() == [SYNC, SET_POINT]
    clock.wait_until(MS)
    assert clock.receive() == [SYNC]


def test_a_master_is_served_while_time_stands_still() -> None:
    """Before the first SYNC other frames are answered, so that the node can be configured."""
    served: list[Frame] = []
    clock = FollowSync(ScriptedBus([[SDO], [SDO, SYNC]]), MS)
    clock.serve = served.extend
    clock.wait_until(0)
    assert served == [SDO, SDO]
    assert clock.receive() == [SYNC]
