"""The study that leaves out rules: what it remembers, and what it counts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded
from tests.studies.answer import Answer, Named
from tests.studies.generator.cases import case
from tests.studies.generator.effects import EFFECTS
from tests.studies.rules import ablation
from tests.studies.rules.ablation import AND, WITH_ALL, Kept, examine, kept, report
from tests.studies.rules.remembered import remembered


def test_what_is_remembered_is_what_would_be_computed() -> None:
    """To the bit, and asked twice it is the same; nothing remembers afterwards."""
    model, data = knee_model(), [recorded({}, "steps", 3)]
    free, original = parameters.ordinary(model)[:2], Observer.innovations

    def asked() -> np.ndarray:
        fitter = Fitter(Observer(model, INSTRUMENTS), data)
        fitter.freeze(free, np.zeros(2))
        near, far = (fitter.residual(free, np.array([x, 0.0])) for x in (0.1, 0.2))
        assert not np.array_equal(near, far)
        return near

    computed = asked()
    with remembered():
        for _ in range(2):
            assert np.array_equal(asked(), computed)
    assert Observer.innovations is original


def test_a_rule_is_counted_by_the_answers_that_change_without_it() -> None:
    """Of three cases it decides in two: one loses its name without it, the other was not asked.

    Where it decides nothing, the answer without it is known; so it is of several at once.
    """
    cases = [case("medium", number) for number in (121, 125, 129)]
    names = [c.name for c in cases]
    right = {c.name: Answer((Named(EFFECTS[next(iter(c.effects))].name),)) for c in cases}
    answers = {(name, WITH_ALL): answer for name, answer in right.items()}
    answers[names[0], "chance"] = replace(right[names[0]], named=())
    deciding = dict(zip(names, map(frozenset, (["chance"], ["chance"], [])), strict=True))
    both = f"chance{AND}weak effects"
    answers[names[1], both] = right[names[1]]
    table = report(Kept(answers, deciding), {c.name: c for c in cases}).splitlines()
    (line,) = [row for row in table if row.startswith(f"| {both} |")]
    assert "| 2 of 3 (0.21-0.94) | 0 of 2 (0.00-0.66) |" in line
    (line,) = [row for row in table if row.startswith("| chance |")]
    assert "| 2 of 3 (0.21-0.94) | 1 of 2 (0.09-0.91) |" in line
    assert "2/2 → 1/2" in line
    assert table[-1].startswith("3 of 3 (0.44-1.00) cases right")


def test_a_rule_that_decides_nothing_is_not_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file keeps which rules decided; it is searched again for these alone, and once."""
    asked: list[str] = []
    monkeypatch.setattr(ablation, "campaign", lambda _: ([], []))
    monkeypatch.setattr(ablation, "_answered", lambda *_: asked.append("") or Answer())
    which, file = case("none", 121), tmp_path / "ablation.jsonl"
    examine(which, [], file)
    assert len(asked) == 1
    assert kept(file).deciding == {which.name: frozenset({"chance"})}  # which cannot be watched
    for _ in "ab":
        examine(which, ["chance", "held-out gain"], file)
        assert len(asked) == 2
