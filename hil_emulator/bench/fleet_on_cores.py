"""Speed of the quadruped on all cores, and of twice as many actuators in real time."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from hil_emulator.bench.fleet import (
    COMBINED,
    QUADRUPED,
    SYNC,
    TICKS,
    combined,
    commands,
    exchange,
    fleet,
    leave_one_tpdo,
    operational,
    timed_ticks,
)
from hil_emulator.config.machine import MachineSettings
from hil_emulator.platform.worker import Worker, usable_cores
from hil_emulator.simulation import realtime
from hil_emulator.simulation.clock import WallClock
from hil_emulator.simulation.independent import parts
from hil_emulator.simulation.loop import Timing, run

_REPEATS = 5


@dataclass(frozen=True)
class FleetOnCores:
    """Speed and punctuality with a process for each core.

    Attributes:
        processes: number of processes.
        lockstep_x: emulated over elapsed time of eight actuators, of the slowest process.
        combined_x: emulated over elapsed time of 32 one-node actuators, of the slowest process.
        held: number of actuators in real time.
        lateness_us: p99 of the ticks' lateness in real time, of the latest process [us].
        execution_us: p99 of the ticks' duration in real time, of the slowest process [us].
        late: number of ticks that began a whole period late or more, in all processes.
        ticks: number of ticks in all processes.

    """

    processes: int
    lockstep_x: float
    combined_x: float
    held: int
    lateness_us: float
    execution_us: float
    late: int
    ticks: int


def measure_on_cores(cache: Path, duration: float) -> FleetOnCores:
    """Run machines in lock-step, and sixteen actuators in real time for `duration` [s]."""
    cores = usable_cores()
    quadruped, doubled = fleet(QUADRUPED), fleet(2 * QUADRUPED)
    held: list[Timing] = _at_once(doubled, cores, partial(_kept, duration), cache)
    return FleetOnCores(
        processes=len(parts(quadruped, cores)),
        lockstep_x=_lockstep_x(quadruped, _timed, cache),
        combined_x=_lockstep_x(combined(COMBINED), _timed_combined, cache),
        held=len(doubled.actuators),
        lateness_us=max(t.lateness.percentile_us(0.99) for t in held),
        execution_us=max(t.execution.percentile_us(0.99) for t in held),
        late=sum(t.overruns for t in held),
        ticks=sum(t.ticks for t in held),
    )


Work = Callable[[MachineSettings, Path, Callable[[], None]], Any]
"""Measurement on a part of the machine; it calls its last argument just before it begins."""


def _lockstep_x(settings: MachineSettings, work: Work, cache: Path) -> float:
    """Return the best emulated over elapsed time of several runs, that of the slowest process."""
    cores = usable_cores()
    runs: list[list[float]] = [_at_once(settings, cores, work, cache) for _ in range(_REPEATS)]
    return TICKS * settings.actuators[0].config.tick_ns * 1e-9 / min(max(run) for run in runs)


def _at_once(settings: MachineSettings, cores: int, work: Work, cache: Path) -> list[Any]:
    """Return the result of each part's process; all processes begin together."""
    workers = [Worker(partial(_send_result, part, work, cache)) for part in parts(settings, cores)]
    for worker in workers:
        worker.line.recv()
    for worker in workers:
        worker.line.send("go")
    return [_answer(worker) for worker in workers]


def _answer(worker: Worker) -> Any:
    answer = worker.line.recv()
    worker.join()
    return answer


def _send_result(part: MachineSettings, work: Work, cache: Path, line: Connection) -> None:
    def begin() -> None:
        line.send("ready")
        line.recv()

    line.send(work(part, cache, begin))


def _timed(part: MachineSettings, cache: Path, begin: Callable[[], None]) -> float:
    """Return the time of `TICKS` in lock-step [s]."""
    with operational(part, cache) as (machine, peers):
        begin()
        return timed_ticks(machine, peers, commands(part))[0]


def _timed_combined(part: MachineSettings, cache: Path, begin: Callable[[], None]) -> float:
    """Return the time of `TICKS` in lock-step with one TPDO per node, sent at every SYNC [s]."""
    with operational(part, cache) as (machine, peers):
        leave_one_tpdo(machine)
        begin()
        return timed_ticks(machine, peers, [SYNC])[0]


def _kept(duration: float, part: MachineSettings, cache: Path, begin: Callable[[], None]) -> Timing:
    """Return the timing of ticks in real time, with set points and SYNC in each tick."""
    timing, frames = Timing(), commands(part)
    with operational(part, cache) as (machine, peers):
        realtime.apply()
        begin()
        clock, first_ns = WallClock(machine.tick_ns), machine.now_ns
        while machine.now_ns - first_ns < duration * 1e9:
            run(machine, clock, 1, timing)
            exchange(peers, frames)
    return timing
