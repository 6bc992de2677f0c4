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
from hil_emulator.identify.selection.levels import TOLD_APART
from tests.identify.rig_data import CACHE, INSTRUMENTS, campaign, knee_model, recorded, thinned
from tests.studies.generator.benches import BENCHES
from tests.studies.generator.cases import campaign as blind
from tests.studies.generator.cases import case
from tests.studies.logs.slow_logger import CASES, logged, sort_of

FULL = pytest.mark.full(sibling="test_the_machine_tells_whether_its_current_was_held")
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
    """Whichever end of its period a row tells, the curve is within its own uncertainty."""
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
def test_the_machine_tells_whether_its_current_was_held(ticks: int, answer: str) -> None:
    """A controller at 1 kHz and one as slow as the logger leave other traces, to two threads."""
    model = knee_model()
    logs = [thinned(e, EVERY) for e in campaign({}, 3, ticks=ticks)[0]]
    known = Investigation(logs, [], ordinary(model), [])
    found = followed(Observer(model, INSTRUMENTS), known, TOLD_APART, jobs=2)
    assert found.answer == answer
    assert (found.learn[0].course is None) == (answer == "held")
    assert any("valve_current" in note for note in found.learn[0].notes)


@pytest.mark.parametrize("told", ["held", "moves"])
def test_nobody_asks_who_is_told(told: SetPoints) -> None:
    """Who knows what the controller did between the rows is believed, and it is noted who said it.

    The readings are not looked at: these are none.
    """
    current = np.sin(2e-3 * np.pi * 7.0 * TICKS)
    log = experiment(current, False)
    known = Investigation([log], [log], [], candidates(knee_model(), INSTRUMENTS))
    found = followed(Observer(knee_model(), INSTRUMENTS), known, TOLD_APART, told=told)
    assert found.answer == told
    assert found.candidates == known.candidates
    for e in (*found.learn, *found.check):
        assert (e.course is None) == (told == "held")
        assert any("as you say" in note for note in e.notes)


def test_as_fast_as_the_controller_nothing_changes() -> None:
    """At 1 kHz a current is held from row to row, and nobody asks."""
    log = recorded({}, "steps", 1, 0.2)
    known = Investigation([log], [log], [], [])
    assert followed(Observer(knee_model(), INSTRUMENTS), known, TOLD_APART) is known


def test_what_is_said_of_a_fast_log_is_noted_as_needless() -> None:
    """Who says it of a log at 1 kHz reads that it changed nothing."""
    log = recorded({}, "steps", 1, 0.2)
    known = Investigation([log], [log], [], [])
    found = followed(Observer(knee_model(), INSTRUMENTS), known, TOLD_APART, told="moves")
    assert found.answer == "held"
    for e in (*found.learn, *found.check):
        assert e.course is None
        assert "--set-points" in e.notes[-1]


def test_what_nobody_understands_is_refused() -> None:
    """A program that says anything else is told what may be said."""
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
    """It is no unknown effect, alone or beside one that has a name; where rows are all, it is."""
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
    """What is there is named, or it is said that nobody can tell; nothing is invented."""
    result = logged(CASES[name], rate, held)
    assert sort_of(result, CASES[name].effect) in ("right", "open"), result.reason


@FULL
def test_where_the_readings_do_not_tell_it_the_simpler_answer_does() -> None:
    """Nothing is missing of a healthy axis whose current is held, and it is said on what it rests.

    With a current that moves, its valve would be slow or a dead time be missing.
    """
    which = case("none", 532, 2.0, BENCHES["axis"])
    result = session.identify(load([which.bench.config]), *blind(which), cache=CACHE)
    assert result.verdict == "nothing_missing", result.reason
    assert any("held from row to row" in note for note in result.notes)
    assert "if the current is held" in result.reason


@FULL
@pytest.mark.parametrize("number", [530, 548])
def test_a_current_that_is_held_is_not_told_to_move(number: int) -> None:
    """Both answers are fitted until they stand; a valve's frequency beside a dead time creeps."""
    which = case("none", number, 2.0, BENCHES["axis"])
    model = PlantModel(load([which.bench.config]), CACHE)
    predictor, learn, _, _ = predicting(model, *blind(which))
    assert predictor is not None
    known = Investigation(learn, [], ordinary(model, tolerances(predictor)), [])
    assert followed(predictor, known, TOLD_APART).answer != "moves"


@FULL
@pytest.mark.parametrize(("rate", "held"), [(500, False), (500, True), (200, True)])
def test_a_dead_time_of_one_and_a_half_milliseconds_has_a_name(rate: int, held: bool) -> None:
    """Of 500 rows it is longer than a hold, which is not to be seen then; within 200 it acts."""
    result = logged(CASES["delay"], rate, held)
    assert [f.name for f in result.effects] == ["transport_delay"], result.reason
    low, high = result.effects[0].interval
    assert low < 1.5e-3 < high


@pytest.mark.parametrize(
    ("answer", "believed", "interval", "told"),
    [("held", True, (1.0, 5.0), "longer"), ("unknown", False, (0.0, 3.0), "shorter"),
     ("held", False, (1.0, 3.0), ""), ("moves", False, (1.0, 3.0), "")],
)  # fmt: skip
def test_a_dead_time_whose_current_may_be_held_or_not_has_a_wider_interval(
    answer: SetPoints, believed: bool, interval: tuple[float, float], told: str
) -> None:
    """By half of five milliseconds less half of one, to none at most; readings may tell it."""
    result = Result("missing_effects", f"missing: {dead_time()}", effects=[dead_time()])
    doubt_rows(result, answer, [experiment(np.sin(TICKS), False)], believed)
    assert result.effects[0].interval == pytest.approx([1e-3 * end for end in interval])
    assert str(result.effects[0]) in result.reason
    notes = [note for note in result.notes if "transport_delay is 2 ms" in note]
    assert [told in note for note in notes] == [True] * bool(told)
