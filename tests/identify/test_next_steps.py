"""Recommendations on the first screen of an identification's page."""

from typing import get_args

import pytest

from hil_emulator.identify.conclusion.findings import Refitted
from hil_emulator.identify.conclusion.result import Result, Verdict
from hil_emulator.identify.reporting.next_steps import next_steps


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_leads_somewhere(verdict: Verdict) -> None:
    """Something to do stands there in any case, as a sentence."""
    steps = next_steps(Result(verdict, ""))
    assert steps
    assert all(step.endswith(".") for step in steps)


def test_parameters_that_moved_and_the_next_experiment_are_listed() -> None:
    """By name, after what to do with the answer."""
    moved = {"viscous_friction": Refitted(1.0, 1.3, 1.2, 1.4, "N*s/m", "N*s/m")}
    result = Result("nothing_missing", "", parameters=moved, next_experiment="Record a chirp.")
    assert next_steps(result)[-2:] == [
        "Check in data sheets or on the machine: viscous friction.", "Record a chirp.",
    ]  # fmt: skip
