"""Test statistics of a candidate, the acceptance test, and the ranking of candidates."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import (
    NEARLY_ALL,
    SIGNIFICANCE,
    SMALL_PART,
    chi2_threshold,
)
from hil_emulator.identify.selection.scan import Score, size_penalty

LEAST_HELD_OUT = chi2_threshold(SIGNIFICANCE)
"""Gain in chi-square on held-out data that a candidate must exceed (5 % level)."""


@dataclass(frozen=True)
class Evidence:
    """Test statistics of one candidate.

    Attributes:
        delta_chi2: gain in chi-square of the joint refit on the training data.
        wald: squared estimate over its cluster-robust variance.
        held_out: gain in chi-square on the validation data; NaN without validation data.
        needed: critical value, see `needed_delta_chi2`.
        variance_factor: factor by which correlation increases a variance, see `Clusters`.
        size: estimate, in typical sizes.
        serial_factor: variance factor of the serial correlation alone, as used for free terms.

    """

    delta_chi2: float
    wald: float
    held_out: float
    needed: float
    variance_factor: float = 1.0
    size: float = 0.0
    serial_factor: float = 1.0

    @property
    def passed(self) -> bool:
        """Whether the candidate passes all tests."""
        return not self.objections

    @property
    def objections(self) -> list[str]:
        """Tests that the candidate fails, in words."""
        failed, least = [], self.needed + size_penalty(self.size)
        if self.wald <= least:
            failed.append(f"robust Wald statistic {self.wald:.1f} below {least:.1f}")
        elif self.robust <= least:
            failed.append(f"robust gain in chi-square {self.robust:.1f} below {least:.1f}")
        if np.isfinite(self.held_out) and self.held_out <= LEAST_HELD_OUT:
            failed.append(f"held-out gain {self.held_out:.1f} below {LEAST_HELD_OUT:.1f}")
        return failed

    @property
    def significant(self) -> bool:
        """Whether it is significant on the training data, without a prior on its size."""
        return min(self.wald, self.robust) > self.needed

    @property
    def robust(self) -> float:
        """Gain in chi-square for the effective number of uncorrelated residuals."""
        return self.delta_chi2 / self.variance_factor

    @property
    def serial_robust(self) -> float:
        """Gain corrected for serial correlation only, for comparison with free terms."""
        return self.delta_chi2 / self.serial_factor


@dataclass
class Trial:
    """Joint refit of one candidate.

    Attributes:
        score: of the linear screening.
        fit: with the shape parameters of the effect and, as the last coordinate, its knob.
        evidence: its test statistics.
        deviation: cluster-robust standard deviation of the knob's coordinate.
        partner: candidate that was in the model during the test, see `PairSearch`; "" without.

    """

    score: Score
    fit: Fit
    evidence: Evidence
    deviation: float
    partner: str = ""

    def slim(self) -> None:
        """Delete the Jacobian of the fit, which is large for long recordings."""
        self.fit = replace(self.fit, jacobian=np.zeros((0, len(self.fit.at))))


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the candidates ordered by their gains, best first.

    Held-out data order candidates whose training gains are nearly equal, so that an overfitted law
    does not come first. `_tie_break` orders those that are equivalent on held-out data, too.
    """
    by_delta_chi2 = sorted(trials, key=lambda t: -t.evidence.delta_chi2)
    if not by_delta_chi2 or by_delta_chi2[0].evidence.delta_chi2 <= 0.0:
        return by_delta_chi2
    level = NEARLY_ALL * by_delta_chi2[0].evidence.delta_chi2
    contenders = [t for t in by_delta_chi2 if t.evidence.delta_chi2 >= level]
    if all(np.isfinite(t.evidence.held_out) for t in contenders):
        contenders.sort(key=lambda t: -t.evidence.held_out)
        first = contenders[0].evidence
        equals = [t for t in contenders if _equivalent(t, t.evidence.held_out, first.held_out)
                  and _equivalent(t, t.evidence.delta_chi2, first.delta_chi2)]  # fmt: skip
        contenders = [*sorted(equals, key=_tie_break), *(t for t in contenders if t not in equals)]
    return contenders + [t for t in by_delta_chi2 if t.evidence.delta_chi2 < level]


def _equivalent(trial: Trial, explained: float, best: float) -> bool:
    """Return whether the gain of a candidate is about that of the best one.

    With estimated noise there are few independent values; two standard deviations of a chance gain
    are then ignored.
    """
    chance = 2.0 * math.sqrt(max(best, 0.0)) if trial.fit.effective is not None else 0.0
    return explained >= min((1.0 - SMALL_PART) * best, best - chance)


def _tie_break(trial: Trial) -> tuple[int, bool, float]:
    """Return the sort key of equivalent candidates: assumed shape parameters, place, total gain.

    With estimated noise, as for a balance of forces, effects of the machine come before errors of
    the load cell, and the held-out gain, of few values, is not added.
    """
    explained = trial.evidence.delta_chi2
    if trial.fit.effective is None:
        explained += trial.evidence.held_out
    coordinate, bench = trial.score.coordinate, trial.fit.effective is not None
    return _assumed(coordinate), bench and bool(coordinate.channel), -explained


def _assumed(coordinate: Coordinate) -> int:
    """Return the number of shape parameters of an effect."""
    return len(coordinate.effect.shape) if coordinate.effect else 0
