"""Whether a rule decided something: each call is repeated without the rule."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.selection import law_form, search
from hil_emulator.identify.selection.evidence import Evidence
from hil_emulator.identify.selection.progress import Round, Search
from tests.studies.rules.rules import RULES, changed
from tests.studies.rules.watching import ASKED, deciding, same, watched


@pytest.mark.parametrize(
    ("wald", "held_out", "decides"), [(20.0, 9.0, False), (20.0, 3.8, True), (11.0, 3.8, False)]
)
def test_a_bound_decides_where_it_is_the_only_objection(
    wald: float, held_out: float, decides: bool
) -> None:
    """Evidence that passes either way was not decided by the bound, nor what fails without it."""
    with deciding(["held-out gain"]) as decided:
        evidence = Evidence(100.0, wald, held_out, needed=12.0)
        assert evidence.passed == (wald > 12.0 and not decides)
    assert decided == ({"held-out gain"} if decides else set())


def test_a_judgement_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The repeated judgement leaves no trace in the round: that of the product stays."""
    fit = Fit([], np.zeros(0), np.ones(10), np.zeros((10, 0)), 10.0)
    round_ = Round(fit, [], [], [])
    monkeypatch.setattr(search, "judge", _accepting)
    with deciding(["left by a law", "outshone"]) as rules:
        search.judge(Search([]), round_)
    assert not round_.accepted
    assert rules == {"left by a law"}


def _accepting(_: Search, decided: Round) -> None:
    """Stand in for a judgement that hangs on one constant alone."""
    decided.accepted = law_form.LAW_TOLERANCE < 0.0


def test_a_function_decides_if_its_result_differs() -> None:
    """An empty list of faint effects is the result of a rule that does not object."""
    fit = Fit([], np.zeros(0), np.ones(10), np.zeros((10, 0)), 10.0)
    finished = Search([], rounds=[Round(fit, [], [], [])])
    with deciding(["faint"]) as rules:
        assert search.weak_effects(finished) == []
    assert rules == set()


@pytest.mark.parametrize("constant", ASKED)
def test_what_is_watched_is_there_and_comes_back(constant: str) -> None:
    """Every question of the table can be asked, by a rule that is in the table of rules."""
    (rule,) = [name for name, rule in RULES.items() if constant in rule.without][:1]
    assert watched(rule)
    with deciding([rule]), changed(RULES[rule].without):
        pass


def test_answers_are_compared_to_the_bit() -> None:
    """By what they hold, not by who they are."""
    fits = [Fit([], np.zeros(0), np.array([1.0, np.nan]), np.zeros((2, 0)), 1.0) for _ in "ab"]
    assert same(fits[:1], fits[1:])
    assert not same([1.0, 2.0], [1.0, 2.0 + 1e-15])
    assert not same((1.0,), [1.0])
