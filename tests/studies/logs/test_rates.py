"""The same seal at other sample rates, and its logs in another order: the same answer."""

import json
from functools import cache

import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import Question, identify
from tests.identify.rig_data import CACHE
from tests.studies.logs.rates import DATA, Row, examined, logs

ASKED = ("coulomb_friction", "pressure_friction", "friction_asymmetry", "stribeck_friction")
"""Candidates of the test, which saves time; the study asks for all."""


@cache
def row(rate: int) -> Row:
    """Return the O-ring at a sample rate."""
    return examined("oring", rate, Question(only=ASKED))


@pytest.mark.full(sibling="test_the_order_of_the_logs_does_not_matter")
@pytest.mark.parametrize("rate", [50, 500])
def test_the_sample_rate_does_not_matter(rate: int) -> None:
    """Verdict and names are those of 100 Hz, values lie within each other's intervals."""
    usual, other = row(100), row(rate)
    assert other.result.verdict == usual.result.verdict
    assert other.held_out == pytest.approx(usual.held_out, rel=0.05)
    assert other.held_out < 1.1 * other.least_squares
    one, two = ({f.name: f for f in r.result.effects} for r in (usual, other))
    assert one.keys() == two.keys() == {"coulomb_friction", "pressure_friction"}
    for name in one:
        assert two[name].interval[0] < one[name].value < two[name].interval[1]
        assert one[name].interval[0] < two[name].value < one[name].interval[1]
        assert one[name].interval[0] > 0.0


def test_the_order_of_the_logs_does_not_matter() -> None:
    """One noise is that of all logs: whichever is named first, everything else is the same."""
    config = load([DATA / "friction_rig.toml"])

    def found(training: list[Experiment], validation: list[Experiment]) -> Result:
        return identify(config, training, validation, Question(only=ASKED[:2]), cache=CACHE)

    learn, check = logs("oring", 50, 1, 5), logs("oring", 50, 3, 7)
    one, other = found(learn, check), found(learn[::-1], check[::-1])
    assert json.dumps(one.to_dict()) == json.dumps(other.to_dict())
