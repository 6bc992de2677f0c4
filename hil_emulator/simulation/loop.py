"""The loop: ticks under a clock, with their delay and duration."""

import math
import time
from dataclasses import dataclass, field
from typing import Protocol

from hil_emulator.errors import UserError
from hil_emulator.simulation.clock import Clock

_FINE = 20_000  # bins of 1 us
_COARSE = 100  # bins per e-fold of longer durations: 1 % each
_BINS = _FINE + 1200  # to 20 ms e^12, 54 minutes; the last one takes the rest

_now = time.perf_counter_ns  # looked up once instead of twice in every tick


class Ticking(Protocol):
    """Interface of a rig or machine for the loop."""

    @property
    def now_ns(self) -> int:
        """Emulator time at which the next tick begins [ns]."""
        ...

    @property
    def tick_ns(self) -> int:
        """Period of the loop [ns]."""
        ...

    def step(self) -> None:
        """Execute one tick."""
        ...

    def slip(self, total_ns: int) -> None:
        """Store the total delay of emulator time behind real time."""
        ...


@dataclass
class Durations:
    """A histogram of durations in bins of 1 us, of 1 % from 20 ms on, with constant memory.

    Attributes:
        counts: number of durations per bin.
        longest_ns: the longest duration [ns].

    """

    counts: list[int] = field(default_factory=lambda: [0] * (_BINS + 1))
    longest_ns: int = 0

    def add(self, duration_ns: int) -> None:
        """Count one duration."""
        us = duration_ns // 1000
        self.counts[us if us < _FINE else _coarse_bin(us)] += 1
        if duration_ns > self.longest_ns:
            self.longest_ns = duration_ns

    def percentile_us(self, share: float) -> float:
        """Return the duration [us] that is not exceeded by a share (0 ... 1) of all durations."""
        wanted = share * sum(self.counts)
        passed = 0
        for i, count in enumerate(self.counts):
            passed += count
            if passed >= wanted and count:
                end = i + 1.0 if i < _FINE else _FINE * math.exp((i + 1 - _FINE) / _COARSE)
                return self.longest_ns / 1000.0 if i == _BINS else min(end, self.longest_ns / 1000)
        return 0.0

    def summary(self) -> dict[str, float]:
        """Return p50, p99, p999 and max [us]."""
        return {
            "p50": self.percentile_us(0.5),
            "p99": self.percentile_us(0.99),
            "p999": self.percentile_us(0.999),
            "max": self.longest_ns / 1000.0,
        }


def _coarse_bin(us: int) -> int:
    return min(_FINE + int(_COARSE * math.log(us / _FINE)), _BINS)


@dataclass
class Timing:
    """Timing of a run.

    Attributes:
        lateness: delays of the ticks' begin.
        execution: durations of the ticks.
        ticks: number of ticks.
        overruns: number of ticks that began a whole period late or more.
        slipped_ns: total delay of emulator time behind real time from these ticks.

    """

    lateness: Durations = field(default_factory=Durations)
    execution: Durations = field(default_factory=Durations)
    ticks: int = 0
    overruns: int = 0
    slipped_ns: int = 0

    def add(self, lateness_ns: int, execution_ns: int) -> None:
        """Count a tick."""
        self.ticks += 1
        self.execution.add(execution_ns)
        self.lateness.add(lateness_ns)


def run(
    rig: Ticking, clock: Clock, ticks: int, timing: Timing, stop_when_late: bool = False
) -> None:
    """Run ticks under a clock.

    Raises:
        UserError: for a tick that begins a whole period late, if `stop_when_late`.

    """
    execution, on_time = timing.execution, timing.lateness.counts
    for _ in range(ticks):
        lateness = clock.wait_until(rig.now_ns)
        begin = _now()
        rig.step()
        took = _now() - begin
        if lateness or took >= execution.longest_ns:
            timing.add(lateness, took)
            if lateness >= rig.tick_ns:
                _slip(rig, clock, lateness, timing, stop_when_late)
            continue
        # as `Timing.add`, without its calls: in lock-step this is part of every tick
        timing.ticks += 1
        us = took // 1000
        execution.counts[us if us < _FINE else _coarse_bin(us)] += 1
        on_time[0] += 1


def _slip(rig: Ticking, clock: Clock, lateness: int, timing: Timing, stop: bool) -> None:
    """Handle the last tick, which began a period late or more."""
    timing.overruns += 1
    timing.slipped_ns = clock.slipped_ns
    rig.slip(clock.slipped_ns)
    if stop:
        raise UserError(
            f"stopped: the tick at {(rig.now_ns - rig.tick_ns) * 1e-9:.3f} s began "
            f'{lateness * 1e-6:.1f} ms late and rig.late = "stop"; free the machine, '
            'or set rig.late = "count"'
        )
