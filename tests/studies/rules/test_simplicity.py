"""Which laws are as good as each other, so that the simpler one comes first."""

import json
from pathlib import Path

import pytest

from tests.studies.answer import Answer
from tests.studies.generator.cases import cases_called
from tests.studies.generator.effects import EFFECTS
from tests.studies.rules.simplicity import report, rivalries

CASE = "medium-00"
(TRUE,) = (EFFECTS[key].name for key in next(cases_called(CASE)).effects)


def trial(name: str, delta_chi2: float, held_out: float) -> dict[str, object]:
    """Return a candidate with such gains, refitted alone."""
    return {"name": name, "delta_chi2": delta_chi2, "held_out": held_out, "beside": ""}


def test_the_simpler_law_is_held_against_the_other(tmp_path: Path) -> None:
    """By the smaller of both shares; what gains much less, or nothing elsewhere, contends not."""
    others = ("stribeck_friction", 1000.0, 900.0), ("wall", 500.0, 900.0), ("gravity", 900.0, -1.0)
    rounds = {"trials": [trial(TRUE, 990.0, 880.0), *(trial(*o) for o in others)]}
    row = {"case": CASE, "without": "", "deciding": [],
           "answer": Answer(rounds=(rounds,)).to_dict()}  # fmt: skip
    kept = tmp_path / "kept.jsonl"
    kept.write_text(json.dumps(row) + "\n")
    (rivalry,) = rivalries(kept)
    assert (rivalry.true, rivalry.rival, rivalry.simpler) == (TRUE, "stribeck_friction", True)
    assert rivalry.share == pytest.approx(880.0 / 900.0)
    assert report([rivalry]).endswith("1 of 1 true laws with fewer shapes are equal to a rival, "
                                    "0 of 0 wrong ones to the true law")  # fmt: skip
