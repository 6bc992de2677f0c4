"""Selection of the experiments that can be examined; each of the others gets a note."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.measured.experiment import Experiment

DRIVEN = 0.2e-3
"""Least travel of a driven rod [m] (assumed)."""


class Consistent(NamedTuple):
    """Experiments that can be examined.

    Attributes:
        training: experiments for the fit; all of them if every one is contradictory.
        validation: experiments for the acceptance test.
        left_out: a note for each experiment that is left out.
        contrary: the contradictions, if every experiment for the fit has one; otherwise "".

    """

    training: list[Experiment]
    validation: list[Experiment]
    left_out: list[str]
    contrary: str = ""


def travel(e: Experiment) -> float:
    """Return the range of the rod's position [m]; 0 without a position."""
    position = e.readings.get("position", np.zeros(1))
    return float(np.ptp(position[np.isfinite(position)]))


def without_contradictions(
    training: Sequence[Experiment], validation: Sequence[Experiment], plant: Mapping[str, float]
) -> Consistent:
    """Return the experiments without contradictions, and a note for each of the others.

    All experiments stay on a bench without a driven rod. They also stay if no experiment for the
    fit would be left; the predictor then reports why they cannot be used.
    """
    if all(travel(e) < DRIVEN for e in (*training, *validation)):
        return Consistent(list(training), list(validation), [])
    reasons = {id(e): _reason(e, plant) for e in (*training, *validation)}
    contradicted = [reason for reason in reasons.values() if reason]
    consistent = [e for e in training if not reasons[id(e)]]
    if not consistent:
        return Consistent(list(training), list(validation), [], "; ".join(contradicted))
    held_out = [e for e in validation if not reasons[id(e)]]
    return Consistent(consistent, held_out, [f"left out: {reason}" for reason in contradicted])


def _reason(e: Experiment, plant: Mapping[str, float]) -> str:
    if travel(e) < DRIVEN:
        return f"{e.name}: the rod hardly moves"
    return "; ".join(contradictions([e], plant))
