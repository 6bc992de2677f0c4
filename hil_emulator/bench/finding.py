"""How long it takes to find what is missing, and how much memory."""

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
"""What is missing: an effect that acts in every experiment."""

EXPERIMENTS = 7
"""That `hide` makes, training and validation."""

SHORTEST = 1.0
"""Duration of the shortest useful one [s] (assumed)."""

WARMING = 1.5
"""Duration of the experiments on which the machine code is made and kept [s]."""


@dataclass(frozen=True)
class SearchCost:
    """What was measured of `identify`, each time as a process of its own.

    Attributes:
        data_s: duration of all experiments.
        alone_s: from start to end, in one thread.
        alone_mb: most memory that it had.
        jobs: threads of the second run.
        shared_s: the same with these.
        shared_mb: most memory that it had.
        phases: where the time of one thread goes, measured once more.

    """

    data_s: float
    alone_s: float
    alone_mb: float
    jobs: int
    shared_s: float
    shared_mb: float
    phases: "SearchPhases"


def measure_finding(files: Sequence[Path], data: float, say: Callable[[str], None]) -> SearchCost:
    """Hide an effect in a configuration, and find it in recordings of `data` seconds.

    Raises:
        UserError: if the configuration is wrong, or too little is asked for.

    """
    # a process that is started counts what this one holds as its own
    from hil_emulator.bench.search_phases import measure_phases

    if data < EXPERIMENTS * SHORTEST:
        least = EXPERIMENTS * SHORTEST
        raise UserError(f"{data:g} s is too little to find anything in; take {least:g} s or more")
    jobs = max(2, os.cpu_count() or 1)
    with tempfile.TemporaryDirectory() as folder:
        warm, full = Path(folder) / "warm", Path(folder) / "full"
        say("Preparing recordings and machine code ...")
        for made, duration in ((warm, WARMING), (full, data / EXPERIMENTS)):
            each = ["--duration", f"{duration} s", "--seed", "1", "--out", str(made)]
            time_and_memory(["hide", HIDDEN, *(f"--config={f}" for f in files), *each])
        _identify(warm, 1)
        say("One thread ...")
        alone = _identify(full, 1)
        say(f"{jobs} threads ...")
        shared = _identify(full, jobs)
        say("One thread, under the profiler ...")
        phases = measure_phases(_arguments(full, 1))
    return SearchCost(data, *alone, jobs, *shared, phases)


def _identify(made: Path, jobs: int) -> tuple[float, float]:
    """Return time [s] and memory [MB] of a search in practice data."""
    return time_and_memory(_arguments(made, jobs))


def _arguments(made: Path, jobs: int) -> list[str]:
    """Return the arguments of a search in practice data."""
    configs = sorted(str(f) for f in made.glob("*.toml"))
    training, validation = (sorted(map(str, (made / part).glob("*.csv")))
                            for part in ("training", "validation"))  # fmt: skip
    return ["identify", *configs, *training, "--validate", *validation,
            "--jobs", str(jobs), "--out", str(made / "found"), "--overwrite"]  # fmt: skip
