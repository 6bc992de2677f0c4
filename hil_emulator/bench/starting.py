"""Time that `run` takes to its first ticks, and its peak memory."""

import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.bench.own_process import time_and_memory

_WARM_STARTS = 3


@dataclass(frozen=True)
class StartCost:
    """Time and memory of a short `run`, measured from process start to process end.

    Attributes:
        cold_s: time with an empty cache of machine code [s].
        warm_s: time with a filled cache, the median of three runs [s].
        memory_mb: peak memory, locked where the system allows it [MB].

    """

    cold_s: float
    warm_s: float
    memory_mb: float


def measure_start(files: Sequence[Path]) -> StartCost:
    """Measure a run in real time that ends after its first ticks."""
    short = ["--bus", "virtual:bench start", "--duration", "10 ms"]
    arguments = ["run", *map(str, files), *short]
    with tempfile.TemporaryDirectory() as cache:
        environment = {"NUMBA_CACHE_DIR": cache}
        cold_s, _ = time_and_memory(arguments, environment)
        warm = [time_and_memory(arguments, environment) for _ in range(_WARM_STARTS)]
    return StartCost(cold_s, statistics.median(s for s, _ in warm), max(mb for _, mb in warm))
