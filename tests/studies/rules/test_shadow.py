"""Probability of a candidate by evidence alone."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import cauchy, norm

from tests.studies.answer import Answer, Named
from tests.studies.rules.shadow import log_odds, report, verdicts


def trial(
    gain: float, size: float, name: str = "gravity", held_out: float = math.nan,
    variance_factor: float = 1.0,
) -> dict[str, object]:  # fmt: skip
    """Return the numbers of a candidate."""
    return {"name": name, "delta_chi2": gain, "size": size, "held_out": held_out,
            "variance_factor": variance_factor}  # fmt: skip


@pytest.mark.parametrize(("gain", "size"), [(30.0, 0.2), (100.0, 1.0), (400.0, 5.0)])
def test_the_odds_are_those_of_an_integral_over_all_sizes(gain: float, size: float) -> None:
    """A size that is known to a tenth or better: Laplace's approximation is the integral."""
    deviation = size / math.sqrt(gain)

    def together(x: float) -> float:
        return float(cauchy.pdf(x) * norm.pdf((x - size) / deviation) / norm.pdf(size / deviation))

    reach = 8.0 * deviation
    integral = quad(together, size - reach, size + reach, points=[size])[0]
    assert log_odds(trial(gain, size), 1) == pytest.approx(math.log(integral), abs=0.1)
    assert log_odds(trial(gain, size), 100) == pytest.approx(math.log(integral / 100.0), abs=0.1)


def test_correlated_and_contradicted_gains_are_worth_less() -> None:
    """A gain counts over its variance factor; a loss on held-out data counts against it."""
    plain = log_odds(trial(200.0, 1.0), 100)
    assert log_odds(trial(400.0, 1.0, variance_factor=2.0), 100) == pytest.approx(plain)
    assert log_odds(trial(200.0, 1.0, held_out=-300.0), 100) < 0.0 < plain
    assert log_odds(trial(200.0, 1.0, held_out=100.0), 100) == pytest.approx(plain + 50.0)
    assert log_odds(trial(-3.0, 1.0), 100) == pytest.approx(-math.log(100.0))


def test_disagreements_and_names_that_are_right_are_counted(tmp_path: Path) -> None:
    """Of a right name, a refused one with large odds, and a wrong one, two are sure names."""
    rounds = (
        {"accepted": True, "candidates": 100, "trials": [trial(500.0, 1.0)], "terms": []},
        {"accepted": False, "candidates": 99, "trials": [trial(300.0, 1.0, "wall")], "terms": []},
        {"accepted": True, "candidates": 99, "trials": [trial(200.0, 1.0, "stick")], "terms": []},
    )
    answer = Answer((Named("gravity", ("load_spring",)), Named("stick")), rounds=rounds)
    row = {"case": "medium-14", "without": "", "answer": answer.to_dict(), "deciding": []}
    (tmp_path / "kept.jsonl").write_text(json.dumps(row) + "\n")
    lines = report(list(verdicts(tmp_path / "kept.jsonl"))).splitlines()
    assert lines[0].startswith("medium-14: wall not named")
    assert lines[1] == "1 of 3 rounds in which both disagree"
    assert lines[2].startswith("1 of 2 names of 95% are right")
    assert np.isfinite([v.nats for v in verdicts(tmp_path / "kept.jsonl")]).all()
