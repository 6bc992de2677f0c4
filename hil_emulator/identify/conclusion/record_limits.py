"""Verdicts that a log cannot support because it is too slow or too short."""

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

ADVICE = "log valve_current at the rate at which it is set, or state its course with --set-points"

DOUBTED = ("missing_effects", "unknown_effect", "disagrees")
"""Verdicts that a short record may give by chance."""

SHORTEST = 2.0
"""Shortest record of a moving actuator for a name [s] (assumed). Of 12 healthy machines with a
drifting null, recorded for a second, 2 got a name: `python -m tests.studies.logs.short_records 1`.
"""


def doubt_rows(
    result: Result, answer: SetPoints, experiments: Sequence[Experiment], believed: bool = False
) -> None:
    """Withdraw verdicts that depend on the current between the rows.

    Args:
        result: of the search.
        answer: the course of the current between the rows.
        experiments: the data.
        believed: whether `held` was assumed because it is simpler, without evidence in the data.

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
        note = (
            f"the current changes between the rows {rows}, and what it did there may be what "
            f"acts on the {SPOOL.name}, depending on {spool[0].regressor}; {ADVICE}"
        )
        if result.verdict == "unknown_effect":
            result.verdict, result.reason, result.added = "cannot_tell", note, None
            if result.search is not None and result.search.told is not None:
                result.final_at = result.search.told.at
        else:
            result.unknown, result.notes = [], [*result.notes, note]
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
    """Widen the interval of a named dead time by the delay of a hold, with a note."""
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
        note = f"{DEAD_TIME} is {late * 1e3:g} ms {far}, and its interval holds both"
        result.notes = [*result.notes, f"{note}; {ADVICE}"]


def doubt_haste(result: Result, predictor: Predictor, experiments: Sequence[Experiment]) -> None:
    """Withdraw verdicts that a record this short may give by chance.

    Benches at rest or in balance, without a drifting state, need no minimum.
    """
    seconds = sum(e.samples * e.period for e in experiments)
    hasty = isinstance(predictor, Observer) and seconds < SHORTEST
    if not hasty or result.verdict not in DOUBTED:
        return
    if result.search is not None and result.search.told is not None:
        result.final_at = result.search.told.at
    result.verdict, result.added = "cannot_tell", None
    result.reason = (
        f"{seconds:.2g} s are too short to distinguish a missing effect from chance: "
        f"{result.reason.removeprefix('missing: ')}; record {SHORTEST:g} s or more"
    )
    result.effects, result.unknown = [], []
