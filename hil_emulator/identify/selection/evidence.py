"""What speaks for and against a candidate, whether that justifies a name, and which comes first."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.selection.levels import (
    GREATER_PART,
    NEARLY_ALL,
    ONE_IN_TWENTY,
    SMALL_PART,
    reached_by_chance,
)
from hil_emulator.identify.selection.scan import Score, surprise

LEAST_HELD_OUT = reached_by_chance(ONE_IN_TWENTY)
"""Gain in chi-square on held-out data that one candidate hardly has by chance."""


@dataclass(frozen=True)
class Evidence:
    """For and against one candidate.

    Attributes:
        delta_chi2: gain in chi-square of the joint refit on the training data.
        wald: squared estimate over its variance, serial correlation counted.
        held_out: gain in chi-square on the validation data; NaN without any.
        needed: Wald statistic that is needed, see `needed_delta_chi2`.
        expected: gain on the validation data if the effect has the estimated size there too.
        variance_factor: factor by which correlation widens a variance, see `Clusters`.
        size: estimate, in typical sizes.
        serial_factor: the variance factor by time alone, as that of free terms is.
        estimated: whether the noise is estimated from the residual: few independent values decide.
        another_law: whether it is judged as one of another law than the catalogue's, which may
            be of another size elsewhere.

    """

    delta_chi2: float
    wald: float
    held_out: float
    needed: float
    expected: float = 0.0
    variance_factor: float = 1.0
    size: float = 0.0
    estimated: bool = False
    serial_factor: float = 1.0
    another_law: bool = False

    @property
    def passed(self) -> bool:
        """Whether a name is justified."""
        return not self.objections

    @property
    def contradicted(self) -> bool:
        """Whether all that speaks against it are held-out data."""
        return not self.passed and not self._by_chance

    @property
    def objections(self) -> list[str]:
        """What speaks against it, in words."""
        found = self._by_chance
        if np.isfinite(self.held_out) and self.held_out <= LEAST_HELD_OUT:
            found.append(f"held-out gain {self.held_out:.1f} below {LEAST_HELD_OUT:.1f}")
        elif self.surpassing or not (self.confirmed or self.another_law):
            found.append(f"held-out gain {self.held_out:.0f}, expected {self.expected:.0f}")
        return found

    @property
    def less_elsewhere(self) -> bool:
        """Whether all that speaks against it is that held-out data, which show it, want less."""
        beyond_chance = self.held_out > max(self.needed, LEAST_HELD_OUT)
        return self.contradicted and beyond_chance and not self.surpassing

    @property
    def size_elsewhere(self) -> float:
        """The size that explains the held-out data best, over the estimated one.

        A change d of the residual r gains r'r - |r + d|^2 where d'd is expected; the part of it
        that gains the most is -r'd / d'd.
        """
        return 0.5 * (1.0 + self.held_out / self.expected)

    @property
    def _by_chance(self) -> list[str]:
        """What the training data say against it."""
        least = self.needed + surprise(self.size)
        if self.wald <= least:
            return [f"robust Wald statistic {self.wald:.1f} below {least:.1f}"]
        if self.robust <= least:
            return [f"robust gain in chi-square {self.robust:.1f} below {least:.1f}"]
        return []

    @property
    def robust(self) -> float:
        """Gain in chi-square of as many uncorrelated residuals as these are worth."""
        return self.delta_chi2 / self.variance_factor

    @property
    def beside_terms(self) -> float:
        """The same by time alone, to be held against free terms."""
        return self.delta_chi2 / self.serial_factor

    @property
    def surpassing(self) -> bool:
        """Whether held-out data gain more than the size explains: something else gains there."""
        return self.held_out > self.expected / GREATER_PART + self._spread

    @property
    def _spread(self) -> float:
        """Standard deviation of the gain on held-out data; two where the noise is estimated."""
        deviations = 2.0 if self.estimated else 1.0
        return deviations * 2.0 * float(np.sqrt(self.variance_factor * self.expected))

    @property
    def confirmed(self) -> bool:
        """Whether held-out data gain as the size does, or are evidence and less by chance."""
        least = GREATER_PART * self.expected
        return not self.held_out < min(least, max(self.needed, least - self._spread))


@dataclass
class Trial:
    """One candidate, refitted.

    Attributes:
        score: from the scan.
        fit: with the effect's knob last, and before it what else its law holds.
        evidence: for and against it.
        deviation: standard deviation of the knob's coordinate, serial correlation counted.
        beside: the candidate beside which it was judged, see `Lookahead`; mostly "".

    """

    score: Score
    fit: Fit
    evidence: Evidence
    deviation: float
    beside: str = ""

    def slim(self) -> None:
        """Forget the Jacobian of the fit: those of long recordings are large."""
        self.fit = replace(self.fit, jacobian=np.zeros((0, len(self.fit.at))))


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the candidates in the order of what they explain, the surpassing ones last.

    Where several explain the training data about equally well, held-out data decide: a law that
    holds elsewhere beats one that bends to its data. Where several do that equally well, too, none
    has bent, and all data count.
    """
    by_delta_chi2 = sorted(trials, key=lambda t: -t.evidence.delta_chi2)
    sound = [t for t in by_delta_chi2 if not t.evidence.surpassing]
    return _ranked(sound) + [t for t in by_delta_chi2 if t.evidence.surpassing]


def _ranked(by_delta_chi2: list[Trial]) -> list[Trial]:
    if not by_delta_chi2 or by_delta_chi2[0].evidence.delta_chi2 <= 0.0:
        return by_delta_chi2
    level = NEARLY_ALL * by_delta_chi2[0].evidence.delta_chi2
    contenders = [t for t in by_delta_chi2 if t.evidence.delta_chi2 >= level]
    if all(np.isfinite(t.evidence.held_out) for t in contenders):
        contenders.sort(key=lambda t: -t.evidence.held_out)
        first = contenders[0].evidence
        equals = [t for t in contenders if _as_good(t, t.evidence.held_out, first.held_out)
                  and _as_good(t, t.evidence.delta_chi2, first.delta_chi2)]  # fmt: skip
        contenders = [*sorted(equals, key=_modesty), *(t for t in contenders if t not in equals)]
    return contenders + [t for t in by_delta_chi2 if t.evidence.delta_chi2 < level]


def _as_good(trial: Trial, explained: float, best: float) -> bool:
    """Tell whether a candidate explains about as much as the best.

    Where the noise is estimated, few independent values decide, and two standard deviations of what
    they gain by chance make no difference.
    """
    chance = 2.0 * math.sqrt(max(best, 0.0)) if trial.fit.effective is not None else 0.0
    return explained >= min((1.0 - SMALL_PART) * best, best - chance)


def _modesty(trial: Trial) -> tuple[int, float]:
    """Return what equals are ordered by: assumed parameters, then what they explain of all data.

    Where the noise is estimated, held-out data are too few to be added.
    """
    explained = trial.evidence.delta_chi2
    if trial.fit.effective is None:
        explained += trial.evidence.held_out
    return _assumed(trial.score.coordinate), -explained


def _assumed(coordinate: Coordinate) -> int:
    """Return how many shape parameters of an effect are taken on trust."""
    return len(coordinate.effect.shape) if coordinate.effect else 0
