"""The loop and its delays."""

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
        """Store the delay."""
        self.slipped_ns = total_ns

    def step(self) -> None:
        """Count one tick."""
        self.now_ns += self.tick_ns


class LateClock:
    """A clock whose fifth tick begins 3 ms late."""

    slipped_ns = 3_000_000

    def wait_until(self, t_ns: int) -> int:
        """Return the delay of the tick [ns]."""
        return 3_000_000 if t_ns == 4_000_000 else 10_000


def test_percentiles_are_those_of_the_durations() -> None:
    """Of the durations 1 ... 1000 us, p50 is 500, p99 is 990 and the maximum 1000."""
    durations = Durations()
    for us in range(1, 1001):
        durations.add(us * 1000 - 1)
    assert durations.summary() == {"p50": 500.0, "p99": 990.0, "p999": 999.0, "max": 999.999}


def test_a_duration_beyond_the_histogram_is_still_the_maximum() -> None:
    """A stall of 10 s is stored exactly as the maximum."""
    durations = Durations()
    durations.add(10_000_000_000)
    assert durations.summary()["max"] == 10_000_000.0


def test_a_late_tick_is_counted_and_nothing_is_skipped() -> None:
    """Ten ticks run, one of which was late."""
    rig, timing = CountingRig(), Timing()
    run(rig, LateClock(), 10, timing)
    assert rig.now_ns == 10 * rig.tick_ns
    assert (timing.ticks, timing.overruns) == (10, 1)


def test_slipped_time_is_reported() -> None:
    """The rig receives and records it, and the timing in the summary shows it."""
    rig, timing = CountingRig(), Timing()
    run(rig, LateClock(), 4, timing)
    assert (rig.slipped_ns, timing.slipped_ns) == (0, 0)
    run(rig, LateClock(), 6, timing)
    assert (rig.slipped_ns, timing.slipped_ns) == (3_000_000, 3_000_000)
    assert "1 late, 0.003 s behind real time" in summary(rig, timing, [])


def test_a_percentile_does_not_end_with_the_fine_bins() -> None:
    """Percentiles of a thousand stalls of 21 ms to 21 s are correct within 1 %."""
    durations = Durations()
    for ms in range(1, 1001):
        durations.add(21_000_000 * ms)
    for share in (0.5, 0.99, 0.999):
        assert durations.percentile_us(share) == pytest.approx(21e6 * share, rel=0.011)
    durations.add(10_000_000_000_000)
    assert durations.percentile_us(1.0) == 10_000_000_000.0


def test_a_late_tick_can_end_the_run() -> None:
    """With the policy "stop" the message has the time, the delay and the remedy."""
    with pytest.raises(UserError, match=r"at 0\.004 s began 3\.0 ms late.*free the machine"):
        run(CountingRig(), LateClock(), 10, Timing(), stop_when_late=True)


def test_lock_step_is_never_late() -> None:
    """In lock-step the lateness is 0."""
    timing = Timing()
    run(CountingRig(), LockStep(), 100, timing)
    assert timing.lateness.summary()["max"] == 0.0


def test_a_run_warns_when_time_slips_further(capfd: pytest.CaptureFixture[str]) -> None:
    """It warns once per 0.1 s, so that the warnings do not add load."""
    clock, before = LateClock(), signal.getsignal(signal.SIGTERM)
    clock.slipped_ns = 250_000_000
    keep_running(CountingRig(), clock, 2000, Timing(), lambda: "")
    signal.signal(signal.SIGTERM, before)
    assert capfd.readouterr().err.count("0.250 s behind real time") == 1
