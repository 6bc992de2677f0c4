"""What cannot be told from a record of a second."""

from collections.abc import Sequence

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer import Observer
from hil_emulator.identify.prediction.predictor import Predictor

SHORTEST = 2.0
"""Seconds of a moving actuator from which a name means something (assumed). Of 12 healthy machines
whose null drifts as usual, recorded for a second, 2 were said to lack something:
`python -m tests.identify.short_records 1`."""


def doubt_haste(result: Result, predictor: Predictor, experiments: Sequence[Experiment]) -> None:
    """Take back what so short a record may show by chance: it is said that nobody can tell.

    Benches at rest or in balance, without a state that drifts, are short by nature.
    """
    seconds = sum(e.samples * e.period for e in experiments)
    hasty = isinstance(predictor, Observer) and seconds < SHORTEST
    if not hasty or result.verdict not in ("missing_effects", "unknown_effect"):
        return
    if result.search is not None and result.search.final is not None:
        result.final_at = result.search.final.at
    result.verdict, result.added = "cannot_tell", None
    result.reason = (
        f"{seconds:.2g} s are too short to tell a missing effect from chance: "
        f"{result.reason.removeprefix('missing: ')}; record {SHORTEST:g} s or more"
    )
    result.effects, result.unknown = [], []
