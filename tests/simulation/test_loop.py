"""The loop and its punctuality."""

import signal

import pytest

from hil_emulator.commands.live import keep_running, summary
from hil_emulator.errors import UserError
from hil_emulator.simulation.clock import LockStep
from hil_emulator.simulation.loop import Durations, Timing, run


class CountingRig:
    """A rig that only counts its ticks."""

    tick_ns = 1_000_000

    def __init__(self) -> None:
        self.now_ns = 0
        self.slipped_ns = 0

    def slip(self, total_ns: int) -> None:
        """Take note of it."""
        self.slipped_ns = total_ns

    def step(self) -> None:
        """Let one tick pass."""
        self.now_ns += self.tick_ns


class LateClock:
    """A clock whose fifth tick begins 3 ms late."""

    slipped_ns = 3_000_000

    def wait_until(self, t_ns: int) -> int:
        """Return how late the tick is."""
        return 3_000_000 if t_ns == 4_000_000 else 10_000


def test_percentiles_are_those_of_the_durations() -> None:
    """Of the durations 1 ... 1000 us, p50 is 500, p99 is 990 and the maximum 1000."""
    durations = Durations()
    for us in range(1, 1001):
        durations.add(us * 1000 - 1)
    assert durations.summary() == {"p50": 500.0, "p99": 990.0, "p999": 999.0, "max": 999.999}


def test_a_duration_beyond_the_histogram_is_still_the_maximum() -> None:
    """A stall of ten seconds is remembered as such."""
    durations = Durations()
    durations.add(10_000_000_000)
    assert durations.summary()["max"] == 10_000_000.0


def test_a_late_tick_is_counted_and_nothing_is_skipped() -> None:
    """Ten ticks run, one of which was late."""
    rig, timing = CountingRig(), Timing()
    run(rig, LateClock(), 10, timing)
    assert rig.now_ns == 10 * rig.tick_ns
    assert (timing.ticks, timing.overruns) == (10, 1)


def test_time_that_has_slipped_is_told() -> None:
    """To the rig, which records it, and in the timing, which the summary shows."""
    rig, timing = CountingRig(), Timing()
    run(rig, LateClock(), 4, timing)
    assert (rig.slipped_ns, timing.slipped_ns) == (0, 0)
    run(rig, LateClock(), 6, timing)
    assert (rig.slipped_ns, timing.slipped_ns) == (3_000_000, 3_000_000)
    assert "1 late, 0.003 s behind real time" in summary(rig, timing, [])


def test_a_percentile_does_not_end_with_the_fine_bins() -> None:
    """Of a thousand stalls of 21 ms to 21 s, each share is right within 1 %."""
    durations = Durations()
    for ms in range(1, 1001):
        durations.add(21_000_000 * ms)
    for share in (0.5, 0.99, 0.999):
        assert durations.percentile_us(share) == pytest.approx(21e6 * share, rel=0.011)
    durations.add(10_000_000_000_000)
    assert durations.percentile_us(1.0) == 10_000_000_000.0


def test_a_late_tick_can_end_the_run() -> None:
    """With the policy "stop" the message says when, by how much, and what to do."""
    with pytest.raises(UserError, match=r"at 0\.004 s began 3\.0 ms late.*free the machine"):
        run(CountingRig(), LateClock(), 10, Timing(), stop_when_late=True)


def test_lock_step_is_never_late() -> None:
    """In lock-step there is no lateness to speak of."""
    timing = Timing()
    run(CountingRig(), LockStep(), 100, timing)
    assert timing.lateness.summary()["max"] == 0.0


def test_a_run_warns_when_time_slips_further(capfd: pytest.CaptureFixture[str]) -> None:
    """Once for each tenth of a second, so that the warnings do not add to the load."""
    clock, before = LateClock(), signal.getsignal(signal.SIGTERM)
    clock.slipped_ns = 250_000_000
    keep_running(CountingRig(), clock, 2000, Timing(), lambda: "")
    signal.signal(signal.SIGTERM, before)
    assert capfd.readouterr().err.count("0.250 s behind real time") == 1
