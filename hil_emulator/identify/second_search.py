"""A search, and a second one if a slow log's current did something else between the rows.

What is missing may look like a current that moves there, and a current that is taken to move may
look like an ordinary parameter that hardly any machine has.
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
from hil_emulator.identify.selection.certainty import disbelief, implausible_parameters
from hil_emulator.identify.selection.levels import NORMAL_95, TOLD_APART
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.search import Searcher

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Searched:
    """A search, and of what.

    Attributes:
        asked: what was examined.
        searcher: that searched.
        found: by it; None if it was interrupted.
        believed: whether its current was taken to be held where the readings do not tell.

    """

    asked: Investigation
    searcher: Searcher
    found: Search | None
    believed: bool = False

    @property
    def strained(self) -> bool:
        """Whether it needs an ordinary parameter that one of twenty machines has."""
        fit = self.found.final if self.found else None
        return fit is not None and bool(implausible_parameters(fit))

    @property
    def least_late(self) -> float:
        """How late its current surely comes [s], where that is an ordinary parameter."""
        fit = self.found.reported if self.found else None
        if self.found is None or fit is None or self.found.settled is None:
            return 0.0
        least = {c.name: (at - NORMAL_95 * self.found.settled.deviations[c.name]) * c.scale
                 for c, at in zip(fit.coordinates, fit.at, strict=True)}  # fmt: skip
        return float(least.get(DEAD_TIME, 0.0))

    @property
    def named(self) -> set[str]:
        """The effects that were named."""
        return {c.name for c in self.found.effects} if self.found else set()

    @property
    def disbelief(self) -> float:
        """How little of what was fitted is believed."""
        fit = self.found.final if self.found else None
        return 0.0 if fit is None else disbelief(fit)


def searched(
    predictor: Predictor, given: Investigation, asked: Investigation, told: bool,
    search: Callable[[Investigation], Searched], tell: Tell, jobs: int = 1,
) -> Searched:  # fmt: skip
    """Search, and once more with another course of the current if that is seen or easier believed.

    Who interrupts the second one gets what is known already.

    Args:
        predictor: computes innovations.
        given: what is examined, the current as it was recorded.
        asked: the same with what the current did between the rows.
        told: whether the user has said that; then nobody asks again.
        search: searches.
        tell: takes progress in words.
        jobs: threads.

    """
    first = search(asked)
    if told:
        return first
    again = asked_again(predictor, given, asked, first.found, tell, jobs)
    if again is not None:
        second = search(again)
        if second.found is None:
            return first
        first = second
    if first.asked.answer != "unknown":
        return first
    return _unknown(given, first, search, tell)


def _unknown(
    given: Investigation, first: Searched, search: Callable[[Investigation], Searched], tell: Tell
) -> Searched:
    """Return the simplest answer where the readings do not tell what the current did."""
    if first.least_late > hold(given.learn):
        tell("searching once more: the current comes later than one that is held")
        second = search(late(given))
        if DEAD_TIME in second.named and second.least_late > hold(given.learn):
            return second
    if first.strained:
        tell("searching once more: of a current that was held less may have to be believed")
        second = search(held(given, "less has to be believed then"))
        if second.found is not None and second.disbelief <= first.disbelief:
            return replace(second, believed=True)
    elif first.least_late > 0.0 and not first.named:
        tell("searching once more: a current that is held comes late as well")
        second = search(held(given, "it comes late"))
        simple = second.found is not None and not second.named and not second.strained
        later = first.least_late > hold(given.learn)
        if simple or (later and second.named == {DEAD_TIME}):
            missing = "if it moved" if simple else "in any case"
            said = held(given, f"it comes late; {missing}, a dead time is missing")
            return replace(second, asked=said, believed=True)
    return first


def widen(predictor: Predictor, last: Searched, tell: Tell, jobs: int = 1) -> list[str]:
    """Let intervals hold what values would be if the current was held, where nobody can tell.

    A dead time that stands in for a hold is none of a valve, whose frequency makes up for it.

    Returns:
        What is to be said of that, if it was done.

    """
    found = last.found
    if last.asked.answer != "unknown" or found is None:
        return []
    if found.final is None or found.settled is None:
        return []
    tell("asking what the values are if the current was held")
    try:
        apart = shifts(predictor, last.asked.learn, found.final, jobs)
    except KeyboardInterrupt:
        return []
    # of a dead time that was named, this is told apart
    apart.pop(DEAD_TIME, None)
    deviations = {name: math.hypot(known, apart.get(name, 0.0))
                  for name, known in found.settled.deviations.items()}  # fmt: skip
    found.settled = replace(found.settled, deviations=deviations)
    return ["intervals hold the values of a current that was held from row to row, too"]


def asked_again(
    predictor: Predictor, given: Investigation, asked: Investigation, found: Search | None,
    tell: Tell, jobs: int = 1,
) -> Investigation | None:  # fmt: skip
    """Return what the current did between rows by a model with what was found, if not the same.

    What was missing may have decided what the readings do not tell.
    """
    if found is None or not found.effects or found.final is None:
        return None
    again = course(predictor, given, tell, found.final, jobs=jobs)
    if again is None or again.answer == asked.answer:
        return None
    tell("searching once more: with what was found, the readings tell otherwise of the current")
    return again


def course(
    predictor: Predictor, given: Investigation, tell: Tell, model: Fit | None = None,
    told: SetPoints = "unknown", jobs: int = 1,
) -> Investigation | None:  # fmt: skip
    """Return the same with what the current did between rows, or None after Ctrl-C."""
    try:
        return followed(predictor, given, TOLD_APART, tell, model, told, jobs)
    except KeyboardInterrupt:
        return None
