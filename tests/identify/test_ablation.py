"""The study that leaves out rules: what it remembers, and what it counts."""

from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction import parameters
from hil_emulator.identify.prediction.observer import Observer
from tests.identify.ablation import WITH_ALL, report
from tests.identify.answer import Answer, Named
from tests.identify.generator.cases import case
from tests.identify.generator.effects import EFFECTS
from tests.identify.remembered import remembered
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded


def test_what_is_remembered_is_what_would_be_computed() -> None:
    """To the bit, and asked twice it is the same; nothing remembers afterwards."""
    model = knee_model()
    fitter = Fitter(Observer(model, INSTRUMENTS), [recorded({}, "steps", 3)])
    free, own = parameters.ordinary(model)[:2], Observer.innovations
    fitter.freeze(free, np.zeros(2))
    computed = fitter.residual(free, np.array([0.1, 0.0]))
    with remembered():
        for _ in range(2):
            fitter.freeze(free, np.zeros(2))
            assert np.array_equal(fitter.residual(free, np.array([0.1, 0.0])), computed)
            assert not np.array_equal(fitter.residual(free, np.array([0.2, 0.0])), computed)
    assert Observer.innovations is own


def test_a_rule_is_counted_by_the_answers_that_change_without_it() -> None:
    """Of two cases one loses its name without a rule, the other keeps it."""
    cases = [case("medium", number) for number in (121, 125)]
    right = {c.name: Answer((Named(EFFECTS[next(iter(c.effects))].name),)) for c in cases}
    answers = {(name, rule): answer for name, answer in right.items()
               for rule in (WITH_ALL, "gain")}  # fmt: skip
    answers[cases[0].name, "gain"] = replace(right[cases[0].name], named=())
    table = report(answers, {c.name: c for c in cases}).splitlines()
    (line,) = [row for row in table if row.startswith("| gain |")]
    assert "1 of 2" in line
    assert "2/2 → 1/2" in line
    assert table[-1].startswith("2 of 2 cases right")
