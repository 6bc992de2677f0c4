"""What speaks for and against a candidate, whether that justifies a name, and which comes first."""

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
"""Gain in chi-square on held-out data that one candidate hardly has by chance."""


@dataclass(frozen=True)
class Evidence:
    """For and against one candidate.

    Attributes:
        delta_chi2: gain in chi-square of the joint refit on the training data.
        wald: squared estimate over its variance, serial correlation counted.
        held_out: gain in chi-square on the validation data; NaN without any.
        needed: Wald statistic that is needed, see `needed_delta_chi2`.
        variance_factor: factor by which correlation widens a variance, see `Clusters`.
        size: estimate, in typical sizes.
        serial_factor: the variance factor by time alone, as that of free terms is.

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
        """Whether a name is justified."""
        return not self.objections

    @property
    def objections(self) -> list[str]:
        """What speaks against it, in words."""
        found, least = [], self.needed + size_penalty(self.size)
        if self.wald <= least:
            found.append(f"robust Wald statistic {self.wald:.1f} below {least:.1f}")
        elif self.robust <= least:
            found.append(f"robust gain in chi-square {self.robust:.1f} below {least:.1f}")
        if np.isfinite(self.held_out) and self.held_out <= LEAST_HELD_OUT:
            found.append(f"held-out gain {self.held_out:.1f} below {LEAST_HELD_OUT:.1f}")
        return found

    @property
    def significant(self) -> bool:
        """Whether it is no chance, whatever its size, and whatever held-out data say."""
        return min(self.wald, self.robust) > self.needed

    @property
    def robust(self) -> float:
        """Gain in chi-square of as many uncorrelated residuals as these are worth."""
        return self.delta_chi2 / self.variance_factor

    @property
    def serial_robust(self) -> float:
        """The same by time alone, to be held against free terms."""
        return self.delta_chi2 / self.serial_factor


@dataclass
class Trial:
    """One candidate, refitted.

    Attributes:
        score: from the scan.
        fit: with the effect's knob last, and before it what else its law holds.
        evidence: for and against it.
        deviation: standard deviation of the knob's coordinate, serial correlation counted.
        partner: the candidate beside which it was judged, see `PairSearch`; mostly "".

    """

    score: Score
    fit: Fit
    evidence: Evidence
    deviation: float
    partner: str = ""

    def slim(self) -> None:
        """Forget the Jacobian of the fit: those of long recordings are large."""
        self.fit = replace(self.fit, jacobian=np.zeros((0, len(self.fit.at))))


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the candidates in the order of what they explain.

    Where several explain the training data about equally well, held-out data decide: a law that
    holds elsewhere beats one that bends to its data. Where several do that equally well, too, none
    has bent, and all data count.
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
    """Tell whether a candidate explains about as much as the best.

    Where the noise is estimated, few independent values decide, and two standard deviations of what
    they gain by chance make no difference.
    """
    chance = 2.0 * math.sqrt(max(best, 0.0)) if trial.fit.effective is not None else 0.0
    return explained >= min((1.0 - SMALL_PART) * best, best - chance)


def _tie_break(trial: Trial) -> tuple[int, bool, float]:
    """Return what equals are ordered by: assumed parameters, the place, what they explain of all.

    Where the noise is estimated, as on a bench of forces, effects of the machine come before errors
    of the load cell, and held-out data are too few to be added.
    """
    explained = trial.evidence.delta_chi2
    if trial.fit.effective is None:
        explained += trial.evidence.held_out
    coordinate, bench = trial.score.coordinate, trial.fit.effective is not None
    return _assumed(coordinate), bench and bool(coordinate.channel), -explained


def _assumed(coordinate: Coordinate) -> int:
    """Return how many shape parameters of an effect are taken on trust."""
    return len(coordinate.effect.shape) if coordinate.effect else 0
