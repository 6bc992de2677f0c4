"""Which experiments of a campaign can be examined: the others are left out by name."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.measured.experiment import Experiment

DRIVEN = 0.2e-3
"""Least travel of a rod that was moved at all [m] (assumed)."""


class Sound(NamedTuple):
    """Experiments that can be examined.

    Attributes:
        training: of those for the fit; all of them where none can be.
        validation: of those for the acceptance test.
        left_out: a note for each of the others.
        contrary: what they contradict, where none for the fit can be examined; "" otherwise.

    """

    training: list[Experiment]
    validation: list[Experiment]
    left_out: list[str]
    contrary: str = ""


def travel(e: Experiment) -> float:
    """Return how far the rod moves [m]; 0 without a position."""
    position = e.readings.get("position", np.zeros(1))
    return float(np.ptp(position[np.isfinite(position)]))


def without_contradictions(
    training: Sequence[Experiment], validation: Sequence[Experiment], plant: Mapping[str, float]
) -> Sound:
    """Return the experiments that contradict nothing, and a note for each of the others.

    On a bench that moves no rod, and where nothing would be left to learn from, all stay: there is
    nothing to go on with, and whoever predicts says why.
    """
    if all(travel(e) < DRIVEN for e in (*training, *validation)):
        return Sound(list(training), list(validation), [])
    reasons = {id(e): _reason(e, plant) for e in (*training, *validation)}
    said = [reason for reason in reasons.values() if reason]
    sound = [e for e in training if not reasons[id(e)]]
    if not sound:
        return Sound(list(training), list(validation), [], "; ".join(said))
    held_out = [e for e in validation if not reasons[id(e)]]
    return Sound(sound, held_out, [f"left out: {reason}" for reason in said])


def _reason(e: Experiment, plant: Mapping[str, float]) -> str:
    if travel(e) < DRIVEN:
        return f"{e.name}: the rod hardly moves"
    return "; ".join(contradictions([e], plant))
