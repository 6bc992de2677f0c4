"""A search, repeated if the course of a slow log's current between the rows is another one.

A missing effect may look like a current that changes between the rows. A current that is assumed to
change there may require implausible ordinary parameters.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.set_point_course import (
    DEAD_TIME,
    Investigation,
    followed,
    held,
    hold,
    late,
    shifts,
)
from hil_emulator.identify.measured.between_rows import SetPoints
from hil_emulator.identify.prediction.observer.predictor import Predictor
from hil_emulator.identify.selection.certainty import implausible_parameters, prior_penalty
from hil_emulator.identify.selection.levels import DISTINGUISHABLE, NORMAL_95
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.search import Searcher

Report = Callable[[str], None]
"""Receives progress as text."""


@dataclass(frozen=True)
class Searched:
    """A search and its data.

    Attributes:
        investigation: the examined data and candidates.
        searcher: that searched.
        search: its result; None if it was interrupted.
        held_assumed: whether the current was assumed to be held, without evidence in the readings.

    """

    investigation: Investigation
    searcher: Searcher
    search: Search | None
    held_assumed: bool = False

    @property
    def implausible(self) -> bool:
        """Whether an ordinary parameter has an implausible value, p < 0.05."""
        fit = self.search.final if self.search else None
        return fit is not None and bool(implausible_parameters(fit))

    @property
    def least_dead_time(self) -> float:
        """Lower end of the interval of the current's dead time as an ordinary parameter [s]."""
        fit = self.search.reported if self.search else None
        if self.search is None or fit is None or self.search.reported_model is None:
            return 0.0
        least = {c.name: (at - NORMAL_95 * self.search.reported_model.deviations[c.name]) * c.scale
                 for c, at in zip(fit.coordinates, fit.at, strict=True)}  # fmt: skip
        return float(least.get(DEAD_TIME, 0.0))

    @property
    def named(self) -> set[str]:
        """The effects that were named."""
        return {c.name for c in self.search.effects} if self.search else set()

    @property
    def prior_penalty(self) -> float:
        """Part of chi-square that comes from the priors of ordinary parameters."""
        fit = self.search.final if self.search else None
        return 0.0 if fit is None else prior_penalty(fit)


def searched(
    predictor: Predictor, given: Investigation, first_choice: Investigation, stated: bool,
    search: Callable[[Investigation], Searched], report: Report, jobs: int = 1,
) -> Searched:  # fmt: skip
    """Search, and search again if another course of the current is more plausible.

    If the second search is interrupted, the result of the first one is returned.

    Args:
        predictor: computes innovations.
        given: the data with the recorded current, and the candidates.
        first_choice: the same with a course of the current between the rows.
        stated: whether the user has stated this course; it is then not changed.
        search: searches.
        report: receives progress as text.
        jobs: threads.

    """
    first = search(first_choice)
    if stated:
        return first
    again = reconsidered(predictor, given, first_choice, first.search, report, jobs)
    if again is not None:
        second = search(again)
        if second.search is None:
            return first
        first = second
    if first.investigation.answer != "unknown":
        return first
    return _undecided(given, first, search, report)


def _undecided(
    given: Investigation, first: Searched, search: Callable[[Investigation], Searched],
    report: Report,
) -> Searched:  # fmt: skip
    """Return the simplest result if the readings do not determine the course of the current."""
    if first.least_dead_time > hold(given.learn):
        report("searching again: the current acts later than a held current")
        second = search(late(given))
        if DEAD_TIME in second.named and second.least_dead_time > hold(given.learn):
            return second
    if first.implausible:
        report("searching again: a held current may need less implausible parameters")
        second = search(held(given, "the parameters are more plausible then"))
        if second.search is not None and second.prior_penalty <= first.prior_penalty:
            return replace(second, held_assumed=True)
    elif first.least_dead_time > 0.0 and not first.named:
        report("searching again: a held current acts late as well")
        second = search(held(given, "it acts late"))
        simple = second.search is not None and not second.named and not second.implausible
        later = first.least_dead_time > hold(given.learn)
        if simple or (later and second.named == {DEAD_TIME}):
            missing = "if it moved" if simple else "in any case"
            noted = held(given, f"it acts late; {missing}, a dead time is missing")
            return replace(second, investigation=noted, held_assumed=True)
    return first


def widen(predictor: Predictor, last: Searched, report: Report, jobs: int = 1) -> list[str]:
    """Widen intervals by the estimates for a held current, if the course is undetermined.

    If the current was held, a dead time of half a hold is an artefact, and the estimate of the
    valve's frequency compensates for it.

    Returns:
        A note on that, if intervals were widened.

    """
    search = last.search
    if last.investigation.answer != "unknown" or search is None:
        return []
    if search.final is None or search.reported_model is None:
        return []
    report("estimating the values for a held current")
    try:
        shift = shifts(predictor, last.investigation.learn, search.final, jobs)
    except KeyboardInterrupt:
        return []
    # `record_limits` widens the interval of a named dead time
    shift.pop(DEAD_TIME, None)
    deviations = {name: math.hypot(deviation, shift.get(name, 0.0))
                  for name, deviation in search.reported_model.deviations.items()}  # fmt: skip
    search.reported_model = replace(search.reported_model, deviations=deviations)
    return ["intervals include the values for a current that was held from row to row"]


def reconsidered(
    predictor: Predictor, given: Investigation, chosen: Investigation, search: Search | None,
    report: Report, jobs: int = 1,
) -> Investigation | None:  # fmt: skip
    """Return another course of the current that the model with the named effects gives, if any.

    The missing effects may have hidden the course from the readings.
    """
    if search is None or not search.effects or search.final is None:
        return None
    again = course(predictor, given, report, search.final, jobs=jobs)
    if again is None or again.answer == chosen.answer:
        return None
    report("searching again: with the named effects the current has another course")
    return again


def course(
    predictor: Predictor, given: Investigation, report: Report, model: Fit | None = None,
    stated: SetPoints = "unknown", jobs: int = 1,
) -> Investigation | None:  # fmt: skip
    """Return the data with a course of the current between the rows, or None after Ctrl-C."""
    try:
        return followed(predictor, given, DISTINGUISHABLE, report, model, stated, jobs)
    except KeyboardInterrupt:
        return None
