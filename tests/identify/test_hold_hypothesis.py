"""A second search with another course of a slow log's current between the rows."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify import hold_hypothesis
from hil_emulator.identify.conclusion.record_limits import doubt_rows
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.reported_model import ReportedModel
from hil_emulator.identify.estimation.set_point_course import Investigation
from hil_emulator.identify.hold_hypothesis import Searched, searched, widen
from hil_emulator.identify.measured.between_rows import CONTROLLER, SetPoints
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import candidates, ordinary
from hil_emulator.identify.selection.certainty import prior_penalty
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.search import Searcher
from tests.identify.rig_data import INSTRUMENTS, knee_model

LOG = Experiment("log", 5e-3, np.sin(np.arange(0.0, 1000.0, 5.0)), {"position": np.zeros(200)})
HOLD = 0.5 * (LOG.period - CONTROLLER)
"""How much later a current that is held comes than one that moves [s]."""

DEAD_TIME = next(c for c in candidates(knee_model(), INSTRUMENTS) if c.name == "transport_delay")
OBSERVER = Observer(knee_model(), INSTRUMENTS)
SEARCHER = Searcher(OBSERVER, [], [], [], [])
GIVEN = Investigation([LOG], [], [], [DEAD_TIME])


def lateness(late: float, effects: list[Coordinate]) -> Search:
    """Return a search with a delay of the current [s], known to 0.1 ms."""
    fit = Fit([DEAD_TIME], np.array([late / DEAD_TIME.scale]), np.zeros(0), np.zeros((0, 1)), 0.0)
    reported = ReportedModel(fit, {DEAD_TIME.name: 1e-4 / DEAD_TIME.scale}, {}, [])
    return Search([], effects=effects, final=fit, reported_model=reported)


def answered(
    result_of: Callable[[Investigation], Search], stated: bool = False, named: bool = True
) -> Searched:
    """Return the answer if the readings do not determine the course of the current.

    Args:
        result_of: returns the result of a search.
        stated: whether the user has stated the course.
        named: whether the first search may name a dead time.

    """
    asked = replace(GIVEN, answer="unknown", candidates=GIVEN.candidates if named else [])

    def search(asked: Investigation) -> Searched:
        return Searched(asked, SEARCHER, result_of(asked))

    return searched(OBSERVER, GIVEN, asked, stated, search, lambda _: None)


def searched_again(first: float, second: float, named: bool) -> Searched:
    """Return the answer where nothing is missing if the current was held.

    Args:
        first: how much later it comes than one that is held [s], as an ordinary parameter.
        second: the same where a dead time may be named.
        named: whether it is.

    """

    def result_of(asked: Investigation) -> Search:
        if asked.answer == "held":
            return lateness(0.0, [])
        late = HOLD + (second if asked.candidates else first)
        return lateness(late, asked.candidates if named else [])

    return answered(result_of, named=False)


@pytest.mark.parametrize(
    ("before", "after", "anew"),
    [("unknown", "held", True), ("moves", "held", True), ("held", "held", False),
     ("moves", "unknown", True)],
)  # fmt: skip
def test_a_search_begins_anew_if_named_effects_give_another_course(
    monkeypatch: pytest.MonkeyPatch, before: SetPoints, after: SetPoints, anew: bool
) -> None:
    """A missing effect may look like a moving current: the course is estimated again with it.

    "unknown" is another course, too. Without a named effect the course is not estimated again.
    """
    monkeypatch.setattr(hold_hypothesis, "followed", lambda *_: replace(GIVEN, answer=after))
    asked, search = replace(GIVEN, answer=before), lateness(0.0, [DEAD_TIME])
    again = hold_hypothesis.reconsidered(OBSERVER, GIVEN, asked, search, lambda _: None)
    assert (again is not None) == anew
    assert hold_hypothesis.reconsidered(OBSERVER, GIVEN, asked, Search([]), lambda _: None) is None


@pytest.mark.parametrize(
    ("moving", "holding", "holds"), [(4.0, 3.0, True), (4.0, 5.0, False), (0.5, 0.0, False)]
)
def test_a_current_is_held_if_its_parameters_are_more_plausible(
    moving: float, holding: float, holds: bool
) -> None:
    """The course with the smaller prior penalty is chosen if one has implausible parameters."""
    knob = replace(ordinary(knee_model())[0], prior=1.0)

    def result_of(asked: Investigation) -> Search:
        at = holding if asked.answer == "held" else moving
        return Search([], final=Fit([knob], np.array([at]), np.zeros(0), np.zeros((0, 1)), 0.0))

    last = answered(result_of)
    assert last.held_assumed == holds
    assert (last.investigation.answer == "held") == holds
    assert answered(result_of, stated=True).investigation.answer == "unknown"


def test_the_prior_penalty_counts_in_prior_deviations() -> None:
    """Three prior standard deviations give 9 for any width; effects have no penalty."""
    ordinary_one = replace(ordinary(knee_model())[0], prior=0.5)
    effect = replace(DEAD_TIME, prior=np.inf)
    fit = Fit([ordinary_one, effect], np.array([1.5, 7.0]), np.zeros(0), np.zeros((0, 2)), 0.0)
    assert prior_penalty(fit) == pytest.approx(9.0)


@pytest.mark.parametrize(
    ("beyond", "named", "again"),
    [(1.5e-4, True, False), (2.5e-4, False, True), (2.5e-4, True, True)],
)
def test_a_current_later_than_a_hold_has_a_dead_time(
    beyond: float, named: bool, again: bool
) -> None:
    """The dead time is searched for; if it is not named, the first result stays."""
    last = searched_again(beyond, beyond, named)
    assert bool(last.named) == (again and named)


def test_a_dead_time_that_is_no_longer_than_a_hold_has_no_name() -> None:
    """With the valve of the second search a hold explains the delay.

    Then nothing is missing if the current was held; a note states that a dead time is if it moved.
    """
    last = searched_again(4e-4, -5e-5, True)
    assert last.named == set()
    assert last.held_assumed
    assert "if it moved, a dead time is missing" in last.investigation.learn[0].notes[-1]


@pytest.mark.parametrize(
    ("late", "names", "holds"),
    [(3e-4, False, True), (3e-4, True, False), (1.5e-4, False, False)],
)
def test_a_held_current_is_assumed_if_nothing_else_is_missing(
    late: float, names: bool, holds: bool
) -> None:
    """The current is late by a hold and no dead time is needed, or it is not late."""

    def result_of(asked: Investigation) -> Search:
        return lateness(late, [DEAD_TIME] if names and asked.answer == "held" else [])

    last = answered(result_of)
    assert last.held_assumed == holds
    assert (last.investigation.answer == "held") == holds
    result = Result("nothing_missing", "nothing")
    doubt_rows(result, last.investigation.answer, last.investigation.learn, last.held_assumed)
    assert ("if the current is held" in result.reason) == holds


@pytest.mark.parametrize(("beyond", "has"), [(1.5e-4, False), (2.5e-4, True)])
def test_a_dead_time_is_missing_if_a_held_current_has_one_too(beyond: float, has: bool) -> None:
    """A moving current may be later than a hold, which a slow valve may partly explain."""

    def result_of(asked: Investigation) -> Search:
        return lateness(HOLD + beyond, [DEAD_TIME] if asked.answer == "held" else [])

    last = answered(result_of)
    assert (last.investigation.answer, last.held_assumed) == (
        ("held", True) if has else ("unknown", False)
    )
    assert last.named == ({DEAD_TIME.name} if has else set())
    notes = " ".join(last.investigation.learn[0].notes)
    assert ("in any case, a dead time is missing" in notes) == has


@pytest.mark.parametrize(("answer", "wider"), [("unknown", True), ("held", False)])
def test_an_interval_covers_the_value_for_a_held_current(
    monkeypatch: pytest.MonkeyPatch, answer: SetPoints, wider: bool
) -> None:
    """With an unknown course, the interval covers a value four standard deviations away."""
    valve = next(c for c in ordinary(knee_model()) if c.name == "valve_natural_frequency")
    fit = Fit([valve, DEAD_TIME], np.ones(2), np.zeros(0), np.zeros((0, 2)), 0.0)
    search = Search([valve], final=fit)
    search.reported_model = ReportedModel(fit, {valve.name: 0.3, DEAD_TIME.name: 0.1}, {}, [])
    apart = {valve.name: 0.4, DEAD_TIME.name: 9.0}
    monkeypatch.setattr(hold_hypothesis, "shifts", lambda *_: apart)
    last = Searched(replace(GIVEN, answer=answer), SEARCHER, search)
    notes = widen(OBSERVER, last, lambda _: None)
    assert [note for note in notes if "intervals" in note] == notes
    assert bool(notes) == wider
    assert search.reported_model.deviations[valve.name] == pytest.approx(0.5 if wider else 0.3)
    assert search.reported_model.deviations[DEAD_TIME.name] == 0.1
