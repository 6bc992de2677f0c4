"""Where the time of a search goes: by what it looks for, and by what it computes."""

import pstats
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_emulator.bench.own_process import time_and_memory
from hil_emulator.identify.conclusion.conclude import conclude
from hil_emulator.identify.estimation.free_terms import score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.selection.discrepancies import Discrepancies
from hil_emulator.identify.selection.refits import CandidateRefits
from hil_emulator.identify.selection.scan import scan
from hil_emulator.identify.selection.starts import Confirmation
from hil_emulator.identify.session import identify

PHASES: dict[str, Callable[..., Any]] = {
    "ordinary parameters": converge,
    "screening": scan,
    "sizes to begin with": Confirmation.best,
    "refits": CandidateRefits.refit,
    "free terms": score_terms,
    "what acts beside": Discrepancies.__init__,
    "conclusion": conclude,
}
"""What a search does, and the function that does it; `conclude` looks for ordinary parameters once
more where it takes an effect out again."""

ARITHMETIC: dict[str, Callable[..., Any]] = {
    "predictions": Observer.innovations,
    "gains": Observer.freeze,
    "free terms": Observer.through,
}
"""What it computes in compiled loops."""


@dataclass(frozen=True)
class SearchPhases:
    """What was measured under Python's profiler, in one thread.

    Attributes:
        whole_s: of the search, without the start of the process and reading of files.
        phases_s: of that, by what it looks for; see `PHASES`.
        arithmetic_s: of that, by what it computes; see `ARITHMETIC`.
        predictions: of one experiment each.
        fits: of some parameters to all experiments.
        over_arithmetic: how many times as long it takes as its arithmetic alone.

    """

    whole_s: float
    phases_s: dict[str, float]
    arithmetic_s: dict[str, float]
    predictions: int
    fits: int
    over_arithmetic: float


def measure_phases(arguments: Sequence[str]) -> SearchPhases:
    """Run `identify` with these arguments under the profiler, as a process of its own.

    Raises:
        UserError: what it said when it failed.

    """
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "profile"
        time_and_memory(arguments, profile=kept)
        seen = KeptProfile(kept)
    whole, _ = seen.of(identify)
    arithmetic = {name: seen.of(loop)[0] for name, loop in ARITHMETIC.items()}
    return SearchPhases(
        whole, {name: seen.of(phase)[0] for name, phase in PHASES.items()}, arithmetic,
        seen.of(Observer.innovations)[1], seen.of(Fitter.fit)[1], whole / sum(arithmetic.values()),
    )  # fmt: skip


class KeptProfile:
    """What the profiler of a process has kept.

    Args:
        file: where.

    """

    def __init__(self, file: Path) -> None:
        # the stubs know only of the report that is printed
        self._seen: dict[tuple[str, int, str], Any] = vars(pstats.Stats(str(file)))["stats"]

    def of(self, function: Callable[..., Any]) -> tuple[float, int]:
        """Return the time in a function and all that it calls [s], and how often it was called."""
        code = function.__code__
        key = code.co_filename, code.co_firstlineno, code.co_name
        _, calls, _, time, _ = self._seen.get(key, (0, 0, 0.0, 0.0, {}))
        return float(time), int(calls)
