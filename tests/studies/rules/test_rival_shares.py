"""Gains of rivals in kept answers, and a bound for healthy machines."""

import json
from pathlib import Path

import pytest

from hil_emulator.identify.selection.levels import NOTICEABLE
from tests.studies.answer import Answer
from tests.studies.generator.cases import cases_called
from tests.studies.rules.healthy_terms import largest
from tests.studies.rules.rival_shares import report, shares


def found(**gains: float) -> dict[str, object]:
    """Return a round with such gains, of candidates that were refitted alone."""
    trials = [{"name": n, "delta_chi2": g, "beside": ""} for n, g in gains.items()]
    return {"trials": trials}


def test_the_true_effect_is_held_against_the_best(tmp_path: Path) -> None:
    """Of four rounds one has nothing to find, and one does not know the effect."""
    hidden = next(iter(next(cases_called("medium-00")).effects))
    rounds = (found(**{hidden: 900.0, "wall": 1000.0}), found(**{hidden: 200.0}),
              found(wall=500.0), found(**{hidden: 20.0, "wall": 40.0}))  # fmt: skip
    row = {"case": "medium-00", "without": "", "deciding": [],
           "answer": Answer(rounds=rounds).to_dict()}  # fmt: skip
    (tmp_path / "kept.jsonl").write_text(json.dumps(row) + "\n")
    lines = report(list(shares(tmp_path / "kept.jsonl"))).splitlines()
    assert lines[0] == f"medium-00: {hidden} gains 0.90 of wall"
    assert lines[1].startswith("1 of 2 true effects gain the most, 1 of the others at least 0.75")


@pytest.mark.full(sibling="studies/test_study.py::test_a_healthy_foreign_simulator_lacks_nothing")
@pytest.mark.parametrize("machine", ["none-601", "none-603@axis"])
def test_a_healthy_machine_has_terms_that_are_worth_no_word(machine: str) -> None:
    """Its ripple is significant, and smaller than what is noticeable."""
    assert 0.0 < largest(next(cases_called(machine, 2.0)))[0] < NOTICEABLE
