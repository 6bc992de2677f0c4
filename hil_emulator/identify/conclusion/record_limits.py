"""Withdrawal of verdicts for which a log is too slow or too short."""

from collections.abc import Sequence
from dataclasses import replace

from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.estimation.set_point_course import DEAD_TIME, hold
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.free_terms.balances import SPOOL
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.selection.certainty import implausible_parameters

ADVICE = "log valve_current at the rate at which it is set, or state its course with --set-points"

DOUBTED = ("missing_effects", "unknown_effect", "disagrees")
"""Verdicts that may be wrong by chance in a short record."""

SHORTEST = 2.0
"""Shortest record of a moving actuator for a verdict [s] (assumed). In records of 1 s, 2 of 12
healthy machines with a drifting null got a name: `python -m tests.studies.logs.short_records 1`.
"""


def doubt_rows(
    result: Result, answer: SetPoints, experiments: Sequence[Experiment], assumed: bool = False
) -> None:
    """Withdraw verdicts that depend on the current between the rows.

    Args:
        result: of the search.
        answer: the course of the current between the rows.
        experiments: the data.
        assumed: whether `held` was assumed because it is simpler, without evidence in the data.

    """
    if answer == "unknown" or assumed:
        _widen_dead_time(result, answer, hold(experiments))
    rows = f"(logged every {max(e.period for e in experiments) * 1e3:g} ms)"
    if answer == "held":
        if assumed and result.verdict == "nothing_missing":
            result.reason += f", if the current is held from row to row {rows}; {ADVICE}"
        return
    spool = [u for u in result.unknown if u.balance == SPOOL.name]
    late = result.parameters.get(DEAD_TIME) if answer == "unknown" else None
    if spool:
        note = (
            f"either the current changed between the rows {rows} otherwise than assumed, or an "
            f"effect on the {SPOOL.name} over {spool[0].regressor} is missing; {ADVICE}"
        )
        if result.verdict == "unknown_effect":
            result.verdict, result.reason, result.added = "cannot_tell", note, None
            if result.search is not None and result.search.reported is not None:
                result.final_at = result.search.reported.at
        else:
            result.unknown, result.notes = [], [*result.notes, note]
    elif result.verdict not in ("nothing_missing", "wrong_value", "agrees"):
        return
    elif late is not None and late.low > 0.0:
        result.verdict = "cannot_tell"
        result.reason = (
            f"the current acts {late.refitted * 1e3:.2g} ms late: either it is held from row to "
            f"row {rows}, or it changes there and a {DEAD_TIME} is missing; {ADVICE}"
        )
    elif (
        result.search
        and result.search.final
        and (far := implausible_parameters(result.search.final))
    ):
        result.verdict = "cannot_tell"
        result.reason = (
            f"either {' and '.join(far)}, or the current changed between the rows {rows} otherwise "
            f"than assumed; {ADVICE}"
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
    """Withdraw verdicts that may be wrong by chance in a short record.

    Benches in steady state have no minimum length.
    """
    seconds = sum(e.samples * e.period for e in experiments)
    hasty = isinstance(predictor, Observer) and seconds < SHORTEST
    if not hasty or result.verdict not in DOUBTED:
        return
    if result.search is not None and result.search.reported is not None:
        result.final_at = result.search.reported.at
    result.verdict, result.added = "cannot_tell", None
    result.reason = (
        f"{seconds:.2g} s are too short to distinguish a missing effect from chance: "
        f"{result.reason.removeprefix('missing: ')}; record {SHORTEST:g} s or more"
    )
    result.effects, result.unknown = [], []
