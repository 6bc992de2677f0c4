"""How long a run takes to its first ticks, and how much memory."""

import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_emulator.bench.own_process import time_and_memory

_WARM_STARTS = 3


@dataclass(frozen=True)
class StartCost:
    """What was measured of `run`, each time as a process from its start to its end.

    Attributes:
        cold_s: with an empty cache of machine code.
        warm_s: with what that has left there, the median of three.
        memory_mb: most memory, locked where the system lets it.

    """

    cold_s: float
    warm_s: float
    memory_mb: float


def measure_start(files: Sequence[Path]) -> StartCost:
    """Start a run under the wall clock that ends after its first ticks."""
    short = ["--bus", "virtual:bench start", "--duration", "10 ms"]
    arguments = ["run", *map(str, files), *short]
    with tempfile.TemporaryDirectory() as cache:
        own = {"NUMBA_CACHE_DIR": cache}
        cold_s, _ = time_and_memory(arguments, own)
        warm = [time_and_memory(arguments, own) for _ in range(_WARM_STARTS)]
    return StartCost(cold_s, statistics.median(s for s, _ in warm), max(mb for _, mb in warm))
