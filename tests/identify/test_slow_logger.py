"""A logger slower than the controller: what the current did between the rows is not known."""

from typing import get_args

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.identify import session
from hil_emulator.identify.conclusion.findings import Finding, Refitted, Unexplained
from hil_emulator.identify.conclusion.record_limits import ADVICE, doubt_rows
from hil_emulator.identify.conclusion.result import Result, Verdict
from hil_emulator.identify.estimation.set_point_course import Investigation, followed
from hil_emulator.identify.measured.between_rows import BRIDGE, SetPoints, moving
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.free_terms.balances import SPOOL
from hil_emulator.identify.prediction.instrumentation import predicting, tolerances
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.parameters import candidates, ordinary
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.selection.levels import DISTINGUISHABLE
from tests.identify.rig_data import CACHE, INSTRUMENTS, campaign, knee_model, recorded, thinned
from tests.studies.generator.benches import BENCHES
from tests.studies.generator.cases import campaign as blind
from tests.studies.generator.cases import case
from tests.studies.logs.slow_logger import CASES, logged, sort_of

FULL = pytest.mark.full(sibling="test_the_readings_show_whether_the_current_was_held")
EVERY = 5
TICKS = np.arange(1000)


def dead_time() -> Finding:
    """Return a dead time that was named."""
    return Finding(
        name="transport_delay", knob="time", value=2e-3, unit="s", shown="ms",
        interval=(1e-3, 3e-3), explained=0.5, delta_chi2=100.0, held_out=50.0, group=(),
        form_differs=False, rivals=(),
    )  # fmt: skip


def experiment(current: np.ndarray, set_point_first: bool) -> Experiment:
    """Return a log of every fifth tick, its row written before or after the set point acted."""
    last = np.append(current[:1], current[:-1])
    written = (last if set_point_first else current)[::EVERY]
    acting = np.append(written[1:], written[-1]) if set_point_first else written
    readings = {"position": np.zeros(len(acting))}
    return Experiment("log", EVERY * 1e-3, acting, readings, set_point_first=set_point_first)


@pytest.mark.parametrize("set_point_first", [False, True])
def test_a_smooth_current_is_found_between_the_rows(set_point_first: bool) -> None:
    """A row may hold the value at either end of its period; the error is within the uncertainty."""
    random = np.random.default_rng(1)
    current = np.sin(2e-3 * np.pi * 7.0 * TICKS) + 0.01 * random.standard_normal(len(TICKS))
    course = moving(experiment(current, set_point_first)).currents
    inner = slice(3, -3)
    error = (course.current.mean(1) - current.reshape(-1, EVERY).mean(1))[inner]
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert np.mean(error**2 / course.unknown[inner]) < 1.5
    assert not course.jumps[inner].any()


def test_a_jump_between_two_rows_is_known_as_one() -> None:
    """Nobody knows when in its period it came: uniformly, by a variance of a twelfth."""
    random = np.random.default_rng(2)
    current = np.where(TICKS < 502, 0.0, 1.0) + 1e-3 * random.standard_normal(len(TICKS))
    course = moving(experiment(current, False)).currents
    period = 502 // EVERY
    assert course.jumps[period]
    assert course.unknown[period] == pytest.approx(1.0 / 12.0, rel=0.05)
    assert np.median(course.unknown) < BRIDGE * 1e-5
    assert course.jumps.sum() < 6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ticks", "answer"), [pytest.param(1, "moves", marks=FULL), (EVERY, "held")]
)
def test_the_readings_show_whether_the_current_was_held(ticks: int, answer: str) -> None:
    """A controller at 1 kHz and one as slow as the logger leave other traces, to two threads."""
    model = knee_model()
    logs = [thinned(e, EVERY) for e in campaign({}, 3, ticks=ticks)[0]]
    given = Investigation(logs, [], ordinary(model), [])
    course = followed(Observer(model, INSTRUMENTS), given, DISTINGUISHABLE, jobs=2)
    assert course.answer == answer
    assert (course.learn[0].course is None) == (answer == "held")
    assert any("valve_current" in note for note in course.learn[0].notes)


@pytest.mark.parametrize("stated", ["held", "moves"])
def test_a_stated_course_of_the_current_is_used(stated: SetPoints) -> None:
    """The course that the user states is used, with a note, and without a look at the readings.

    This log has no readings that could show it.
    """
    current = np.sin(2e-3 * np.pi * 7.0 * TICKS)
    log = experiment(current, False)
    given = Investigation([log], [log], [], candidates(knee_model(), INSTRUMENTS))
    course = followed(Observer(knee_model(), INSTRUMENTS), given, DISTINGUISHABLE, stated=stated)
    assert course.answer == stated
    assert course.candidates == given.candidates
    for e in (*course.learn, *course.check):
        assert (e.course is None) == (stated == "held")
        assert any("as stated" in note for note in e.notes)


def test_as_fast_as_the_controller_nothing_changes() -> None:
    """At 1 kHz a current is held from row to row, and its course is not examined."""
    log = recorded({}, "steps", 1, 0.2)
    given = Investigation([log], [log], [], [])
    assert followed(Observer(knee_model(), INSTRUMENTS), given, DISTINGUISHABLE) is given


def test_a_course_stated_for_a_fast_log_is_noted_as_needless() -> None:
    """At 1 kHz the statement changes nothing, as a note states."""
    log = recorded({}, "steps", 1, 0.2)
    given = Investigation([log], [log], [], [])
    course = followed(Observer(knee_model(), INSTRUMENTS), given, DISTINGUISHABLE, stated="moves")
    assert course.answer == "held"
    for e in (*course.learn, *course.check):
        assert e.course is None
        assert "--set-points" in e.notes[-1]


def test_an_unknown_course_of_the_current_is_refused() -> None:
    """The message lists the possible courses."""
    with pytest.raises(UserError, match="held, moves, unknown"):
        session.Question(set_points="sometimes")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("answer", "low", "verdict"),
    [("held", 1e-3, "nothing_missing"), ("unknown", 1e-3, "cannot_tell"),
     ("unknown", -1e-4, "nothing_missing"), ("moves", 1e-3, "nothing_missing")],
)  # fmt: skip
def test_a_dead_time_that_may_be_a_hold_leaves_the_answer_open(
    answer: SetPoints, low: float, verdict: Verdict
) -> None:
    """Half a period late is what a current that is held comes, and what a dead time is."""
    late = Refitted(0.0, 2e-3, low, 3e-3, "s", "ms")
    result = Result("nothing_missing", "", parameters={"transport_delay": late})
    doubt_rows(result, answer, [experiment(np.sin(TICKS), False)])
    assert result.verdict == verdict


@pytest.mark.parametrize(
    ("verdict", "after"),
    [("unknown_effect", "cannot_tell"), ("missing_effects", "missing_effects")],
)
def test_a_term_on_the_spool_may_be_the_current_between_the_rows(
    verdict: Verdict, after: Verdict
) -> None:
    """Such a term is not reported as unknown, unless every value of the current has a row."""
    term = Unexplained(SPOOL.name, "rate of the current", "A", (), (), "", 300.0)
    log = experiment(np.sin(TICKS), False)
    for answer in get_args(SetPoints):
        result = Result(verdict, "", unknown=[term])
        doubt_rows(result, answer, [log])
        held = answer == "held"
        assert result.verdict == (verdict if held else after)
        assert (ADVICE in result.reason + "".join(result.notes)) != held
        assert bool(result.unknown) == (held or verdict == "unknown_effect")


@FULL
@pytest.mark.parametrize(
    ("name", "rate", "held"),
    [("healthy-1", 200, False), ("leakage", 200, False), ("delay", 200, False),
     ("healthy-1", 500, True)],
)  # fmt: skip
def test_few_rows_raise_no_false_alarm(name: str, rate: int, held: bool) -> None:
    """The effect is named, or the verdict is that the data do not decide; no other name appears."""
    result = logged(CASES[name], rate, held)
    assert sort_of(result, CASES[name].effect) in ("right", "open"), result.reason


@FULL
def test_without_evidence_in_the_readings_the_simpler_course_is_assumed() -> None:
    """A healthy axis with a held current lacks nothing, and the reason names this assumption.

    With a current that moves, its valve would be slow or a dead time be missing.
    """
    which = case("none", 532, 2.0, BENCHES["axis"])
    result = session.identify(load([which.bench.config]), *blind(which), cache=CACHE)
    assert result.verdict == "nothing_missing", result.reason
    assert any("held from row to row" in note for note in result.notes)
    assert "if the current is held" in result.reason


@FULL
@pytest.mark.parametrize("number", [530, 548])
def test_a_held_current_is_not_reported_as_moving(number: int) -> None:
    """Both courses are fitted to convergence, which a frequency and a dead time delay."""
    which = case("none", number, 2.0, BENCHES["axis"])
    model = PlantModel(load([which.bench.config]), CACHE)
    predictor, learn, _, _ = predicting(model, *blind(which))
    assert predictor is not None
    given = Investigation(learn, [], ordinary(model, tolerances(predictor)), [])
    assert followed(predictor, given, DISTINGUISHABLE).answer != "moves"


@FULL
@pytest.mark.parametrize(("rate", "held"), [(500, False), (500, True), (200, True)])
def test_a_dead_time_of_one_and_a_half_milliseconds_has_a_name(rate: int, held: bool) -> None:
    """Of 500 rows it is longer than a hold, which is not to be seen then; within 200 it acts."""
    result = logged(CASES["delay"], rate, held)
    assert [f.name for f in result.effects] == ["transport_delay"], result.reason
    low, high = result.effects[0].interval
    assert low < 1.5e-3 < high


@pytest.mark.parametrize(
    ("answer", "assumed", "interval", "note"),
    [("held", True, (1.0, 5.0), "longer"), ("unknown", False, (0.0, 3.0), "shorter"),
     ("held", False, (1.0, 3.0), ""), ("moves", False, (1.0, 3.0), "")],
)  # fmt: skip
def test_a_dead_time_whose_current_may_be_held_or_not_has_a_wider_interval(
    answer: SetPoints, assumed: bool, interval: tuple[float, float], note: str
) -> None:
    """By half of 5 ms less half of 1 ms, but not below 0; readings may determine the course."""
    result = Result("missing_effects", f"missing: {dead_time()}", effects=[dead_time()])
    doubt_rows(result, answer, [experiment(np.sin(TICKS), False)], assumed)
    assert result.effects[0].interval == pytest.approx([1e-3 * end for end in interval])
    assert str(result.effects[0]) in result.reason
    notes = [note for note in result.notes if "transport_delay is 2 ms" in note]
    assert [note in line for line in notes] == [True] * bool(note)
