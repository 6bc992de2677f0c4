"""Run time of a search of `identify`, by phase and by compiled loop."""

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
from hil_emulator.identify.selection.starts import NonlinearCheck
from hil_emulator.identify.session import identify

PHASES: dict[str, Callable[..., Any]] = {
    "ordinary parameters": converge,
    "screening": scan,
    "starting points": NonlinearCheck.best,
    "refits": CandidateRefits.refit,
    "free terms": score_terms,
    "discrepancies": Discrepancies.__init__,
    "conclusion": conclude,
}
"""Function of each phase of a search; `conclude` fits the ordinary parameters again if it removes
an effect."""

ARITHMETIC: dict[str, Callable[..., Any]] = {
    "predictions": Observer.innovations,
    "gains": Observer.freeze,
    "free terms": Observer.through,
}
"""Method of each compiled loop of a search."""


@dataclass(frozen=True)
class SearchPhases:
    """Run times and calls of a search under Python's profiler, in one thread.

    Attributes:
        whole_s: run time of the search, without start of the process and reading of files [s].
        phases_s: part of `whole_s` by phase, see `PHASES` [s].
        arithmetic_s: part of `whole_s` by compiled loop, see `ARITHMETIC` [s].
        predictions: number of predictions of one experiment.
        fits: number of fits of some parameters to all experiments.
        over_arithmetic: `whole_s` over the sum of `arithmetic_s`.

    """

    whole_s: float
    phases_s: dict[str, float]
    arithmetic_s: dict[str, float]
    predictions: int
    fits: int
    over_arithmetic: float


def measure_phases(arguments: Sequence[str]) -> SearchPhases:
    """Run `identify` with these arguments under the profiler, in a separate process.

    Raises:
        UserError: if `identify` fails, with its message.

    """
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "profile"
        time_and_memory(arguments, profile=kept)
        profile = KeptProfile(kept)
    whole, _ = profile.of(identify)
    arithmetic = {name: profile.of(loop)[0] for name, loop in ARITHMETIC.items()}
    _, predictions = profile.of(Observer.innovations)
    _, fits = profile.of(Fitter.fit)
    phases = {name: profile.of(phase)[0] for name, phase in PHASES.items()}
    over_arithmetic = whole / sum(arithmetic.values())
    return SearchPhases(whole, phases, arithmetic, predictions, fits, over_arithmetic)


class KeptProfile:
    """Output of Python's profiler.

    Args:
        file: file that the profiler has written.

    """

    def __init__(self, file: Path) -> None:
        # the type stubs cover the printed report only
        self._seen: dict[tuple[str, int, str], Any] = vars(pstats.Stats(str(file)))["stats"]

    def of(self, function: Callable[..., Any]) -> tuple[float, int]:
        """Return a function's cumulative time [s] and its number of calls."""
        code = function.__code__
        key = code.co_filename, code.co_firstlineno, code.co_name
        _, calls, _, time, _ = self._seen.get(key, (0, 0, 0.0, 0.0, {}))
        return float(time), int(calls)
