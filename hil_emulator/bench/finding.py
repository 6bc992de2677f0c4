"""Time and memory that `identify` takes to find a missing effect."""

import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hil_emulator.bench.own_process import time_and_memory
from hil_emulator.errors import UserError

if TYPE_CHECKING:
    from hil_emulator.bench.search_phases import SearchPhases

HIDDEN = "external_leakage"
"""The hidden effect: one that acts in every experiment."""

EXPERIMENTS = 7
"""Number of experiments that `hide` makes, training and validation."""

SHORTEST = 1.0
"""Duration of the shortest useful experiment [s] (assumed)."""

WARMING = 1.5
"""Duration of the experiments that fill the cache of machine code [s]."""


@dataclass(frozen=True)
class SearchCost:
    """Time and memory of `identify`, each run as a separate process.

    Attributes:
        data_s: duration of all experiments [s].
        alone_s: run time with one thread [s].
        alone_mb: peak memory with one thread [MB].
        jobs: number of threads of the second run.
        shared_s: run time with `jobs` threads [s].
        shared_mb: peak memory with `jobs` threads [MB].
        phases: run time with one thread by phase, from a third run under the profiler.

    """

    data_s: float
    alone_s: float
    alone_mb: float
    jobs: int
    shared_s: float
    shared_mb: float
    phases: "SearchPhases"


def measure_finding(
    files: Sequence[Path], data: float, report: Callable[[str], None]
) -> SearchCost:
    """Hide an effect in a configuration, and find it in recordings of `data` seconds.

    Raises:
        UserError: if the configuration is wrong, or `data` is too short.

    """
    # a child's peak memory starts with the memory of this process
    from hil_emulator.bench.search_phases import measure_phases

    if data < EXPERIMENTS * SHORTEST:
        least = EXPERIMENTS * SHORTEST
        raise UserError(f"{data:g} s is too little to find anything in; take {least:g} s or more")
    jobs = max(2, os.cpu_count() or 1)
    with tempfile.TemporaryDirectory() as folder:
        warm, full = Path(folder) / "warm", Path(folder) / "full"
        report("Preparing recordings and machine code ...")
        for made, duration in ((warm, WARMING), (full, data / EXPERIMENTS)):
            each = ["--duration", f"{duration} s", "--seed", "1", "--out", str(made)]
            time_and_memory(["hide", HIDDEN, *(f"--config={f}" for f in files), *each])
        _identify(warm, 1)
        report("One thread ...")
        alone = _identify(full, 1)
        report(f"{jobs} threads ...")
        shared = _identify(full, jobs)
        report("One thread, under the profiler ...")
        phases = measure_phases(_arguments(full, 1))
    return SearchCost(data, *alone, jobs, *shared, phases)


def _identify(made: Path, jobs: int) -> tuple[float, float]:
    """Return run time [s] and peak memory [MB] of a search in practice data."""
    return time_and_memory(_arguments(made, jobs))


def _arguments(made: Path, jobs: int) -> list[str]:
    """Return the arguments of a search in practice data."""
    configs = sorted(str(f) for f in made.glob("*.toml"))
    training, validation = (sorted(map(str, (made / part).glob("*.csv")))
                            for part in ("training", "validation"))  # fmt: skip
    return ["identify", *configs, *training, "--validate", *validation,
            "--jobs", str(jobs), "--out", str(made / "found"), "--overwrite"]  # fmt: skip
