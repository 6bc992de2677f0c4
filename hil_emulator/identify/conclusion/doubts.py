"""What a log is too slow or too short to tell: a verdict that rests on it is taken back."""

from collections.abc import Sequence
from dataclasses import replace

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.estimation.set_point_course import DEAD_TIME, hold
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.free_terms.balances import SPOOL
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.selection.certainty import hardly_believed

ADVICE = "log valve_current at the rate at which it is set, or say with --set-points what it did"

SHORTEST = 2.0
"""Seconds of a moving actuator from which a name means something (assumed). Of 12 healthy machines
whose null drifts as usual, recorded for a second, 2 were said to lack something:
`python -m tests.studies.logs.short_records 1`."""


def doubt_rows(
    result: Result, answer: SetPoints, experiments: Sequence[Experiment], believed: bool = False
) -> None:
    """Take back what the current may have made between the rows: nobody can tell.

    Args:
        result: of the search.
        answer: what the current did.
        experiments: the data.
        believed: whether that was held for what is simpler, not for what readings show.

    """
    if answer == "unknown" or believed:
        _widen_dead_time(result, answer, hold(experiments))
    rows = f"(logged every {max(e.period for e in experiments) * 1e3:g} ms)"
    if answer == "held":
        if believed and result.verdict == "nothing_missing":
            result.reason += f", if the current is held from row to row {rows}; {ADVICE}"
        return
    spool = [u for u in result.unknown if u.balance == SPOOL.name]
    late = result.parameters.get(DEAD_TIME) if answer == "unknown" else None
    if spool:
        said = (
            f"the current changes between the rows {rows}, and what it did there may be what "
            f"acts on the {SPOOL.name}, depending on {spool[0].regressor}; {ADVICE}"
        )
        if result.verdict == "unknown_effect":
            result.verdict, result.reason, result.added = "cannot_tell", said, None
            if result.search is not None and result.search.told is not None:
                result.final_at = result.search.told.at
        else:
            result.unknown, result.notes = [], [*result.notes, said]
    elif result.verdict not in ("nothing_missing", "wrong_value", "agrees"):
        return
    elif late is not None and late.low > 0.0:
        result.verdict = "cannot_tell"
        result.reason = (
            f"the current acts {late.refitted * 1e3:.2g} ms late: it is held from row to row "
            f"{rows}, or changes there and a {DEAD_TIME} is missing; {ADVICE}"
        )
    elif result.search and result.search.final and (far := hardly_believed(result.search.final)):
        result.verdict = "cannot_tell"
        result.reason = (
            f"the current changes between the rows {rows}, and the model explains the data only if "
            f"{' and '.join(far)}; {ADVICE}"
        )


def _widen_dead_time(result: Result, answer: SetPoints, late: float) -> None:
    """Widen the interval of a named dead time by what a hold is late, and say so."""
    for i, f in enumerate(result.effects):
        if f.name != DEAD_TIME:
            continue
        low, high = f.interval
        far, ends = "longer if the current moved between the rows", (low, high + late)
        if answer == "unknown":
            far = "shorter if the current was held from row to row"
            ends = max(low - late, 0.0), high
        result.effects[i] = replace(f, interval=ends)
        result.reason = result.reason.replace(str(f), str(result.effects[i]))
        said = f"{DEAD_TIME} is {late * 1e3:g} ms {far}, and its interval holds both"
        result.notes = [*result.notes, f"{said}; {ADVICE}"]


def doubt_haste(result: Result, predictor: Predictor, experiments: Sequence[Experiment]) -> None:
    """Take back what so short a record may show by chance: it is said that nobody can tell.

    Benches at rest or in balance, without a state that drifts, are short by nature.
    """
    seconds = sum(e.samples * e.period for e in experiments)
    hasty = isinstance(predictor, Observer) and seconds < SHORTEST
    if not hasty or result.verdict not in ("missing_effects", "unknown_effect"):
        return
    if result.search is not None and result.search.told is not None:
        result.final_at = result.search.told.at
    result.verdict, result.added = "cannot_tell", None
    result.reason = (
        f"{seconds:.2g} s are too short to tell a missing effect from chance: "
        f"{result.reason.removeprefix('missing: ')}; record {SHORTEST:g} s or more"
    )
    result.effects, result.unknown = [], []
