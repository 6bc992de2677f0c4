"""Joint refits of the likeliest candidates, and which of them comes first."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.estimation.finite_difference import Derivative
from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.estimation.restarts import nudged
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.prediction.pool import Batch
from hil_emulator.identify.selection.acceptance_test import Evidence, hac_variance_factor
from hil_emulator.identify.selection.parts import GREATER_PART
from hil_emulator.identify.selection.scan import Projection, Score

ITERATIONS_AT_ONCE = 5
"""Iterations of a joint refit, before it is asked whether more are worth while."""

MOST_CONTINUATIONS = 4
"""Most times that it goes on."""

WORTHWHILE_PART = 0.01
"""Part of the gain so far that these iterations must have added for it to go on (assumed)."""

PROMISING = 0.2
"""Part of the best rough gain below which a candidate is not refitted to the end (assumed)."""

CONTENDERS = 0.75
"""Effects that gain at least this part of the best one are judged by held-out data (assumed)."""

AS_GOOD = 0.9
"""Of effects that gain at least this part of the best on held-out and on training data, the one
with the fewest assumed shape parameters is named (assumed)."""


UNBELIEVED = 5.0
"""Prior standard deviations beyond which no ordinary parameter is believed to be, unless it was so
without the candidate (assumed)."""


@dataclass
class Trial:
    """One candidate, refitted.

    Attributes:
        score: from the scan.
        fit: with the effect's knob last, and before it what else its law holds.
        evidence: for and against it.
        deviation: standard deviation of the knob's coordinate, serial correlation counted.
        beside: the candidate beside which it was judged, see `lookahead`; mostly "".

    """

    score: Score
    fit: Fit
    evidence: Evidence
    deviation: float
    beside: str = ""


class CandidateRefits:
    """Refits candidates together with everything that is in the model.

    Args:
        fitter: with the training data frozen.
        base: the fit without any of them.
        held: frozen validation data, or None.
        needed: gain in chi-square that a name needs.

    """

    def __init__(self, fitter: Fitter, base: Fit, held: Batch | None, needed: float) -> None:
        self._fitter, self._base, self._held = fitter, base, held
        self._needed = needed

    def refit(self, likely: Sequence[Score]) -> list[Trial]:
        """Refit candidates, all roughly and the better ones to the end; the best comes first."""
        fits = [self._rough(score) for score in likely]
        self._improve(fits, PROMISING, lambda i: self._complete(fits[i], likely[i].coordinate))
        # further starts are worth while for those that rival the best
        self._improve(fits, GREATER_PART, lambda i: self._pushed(fits[i]))
        fits.reverse()
        return ranked([self._weighed(score, fits.pop()) for score in likely])

    def _improve(self, fits: list[Fit], part: float, better: Callable[[int], Fit]) -> None:
        """Put a better fit in the place of each that gains at least this part of the best."""
        deltas = [self._base.chi2 - fit.chi2 for fit in fits]
        level = max([self._needed, *(part * delta_chi2 for delta_chi2 in deltas)])
        for i, delta_chi2 in enumerate(deltas):
            if delta_chi2 > level:
                fits[i] = better(i)

    def _rough(self, score: Score) -> Fit:
        base = self._base
        free = [*base.coordinates, score.coordinate]
        if score.start is not None:
            return self._fitter.fit(free, score.start, 2)
        at = np.append(base.at + score.estimate * score.response, score.estimate)
        jacobian = np.column_stack([base.jacobian, score.sensitivity])
        return self._fitter.fit(free, at, 2, jacobian=jacobian)

    def _complete(self, fit: Fit, coordinate: Coordinate) -> Fit:
        """Refit with all that the effect's law holds: what is usual need not be what is there."""
        fit = self._converged(fit)
        shapes = self._fitter.predictor.model.shapes(coordinate)
        if not shapes:
            return fit
        free = [*fit.coordinates[:-1], *shapes, fit.coordinates[-1]]
        last = len(fit.at) - 1
        at = np.insert(fit.at, last, np.zeros(len(shapes)))
        wanted = [Derivative(free, at, last + i) for i in range(len(shapes))]
        columns = np.column_stack(list(self._fitter.columns(wanted, fit.residual)))
        jacobian = np.insert(fit.jacobian, [last], columns, axis=1)
        return self._converged(Fit(free, at, fit.residual, jacobian, fit.chi2))

    def _pushed(self, fit: Fit) -> Fit:
        other = nudged(self._fitter, fit, len(fit.at) - 1)
        return fit if other is fit else self._converged(other)

    def _converged(self, fit: Fit) -> Fit:
        for _ in range(MOST_CONTINUATIONS):
            before = fit.chi2
            fit = self._fitter.fit(
                fit.coordinates, fit.at, ITERATIONS_AT_ONCE, jacobian=fit.jacobian
            )
            if before - fit.chi2 < WORTHWHILE_PART * max(self._base.chi2 - fit.chi2, self._needed):
                break
        return fit

    def _weighed(self, score: Score, fit: Fit) -> Trial:
        wald, deviation, hac_variance_factor = self._certainty(score.coordinate.name, fit)
        held_out, expected = float("nan"), 0.0
        if self._held is not None:
            before = self._fitter.residual(self._base.coordinates, self._base.at, self._held)
            after = self._fitter.residual(fit.coordinates, fit.at, self._held)
            held_out = float(before @ before - after @ after)
            expected = float((after - before) @ (after - before))
        delta_chi2 = self._base.chi2 - fit.chi2
        strange = unbelieved(self._base, fit)
        evidence = Evidence(
            delta_chi2, wald, held_out, self._needed, expected, hac_variance_factor, strange
        )  # fmt: skip
        # Jacobians of several fits of a long recording are large
        lean = replace(fit, jacobian=fit.jacobian.astype(np.float32))
        return Trial(score.lean(), lean, evidence, deviation)

    def _certainty(self, name: str, fit: Fit) -> tuple[float, float, float]:
        """Return Wald statistic, standard deviation and HAC variance factor of the knob."""
        last = len(fit.at) - 1
        # an effect that is off has no shape: whether it is there does not hang on how it looks
        rest = [i for i, c in enumerate(fit.coordinates[:-1]) if not c.name.startswith(f"{name}.")]
        others = [fit.coordinates[i] for i in rest]
        project = Projection(Fit(others, fit.at[rest], fit.residual, fit.jacobian[:, rest], 0.0))
        fresh = self._fitter.column(fit.coordinates, fit.at, fit.residual, last)
        shown, believed = np.split(project(fresh), [len(fit.residual)])
        information = float(shown @ shown + believed @ believed)
        if believed @ believed < shown @ shown:
            factor = hac_variance_factor(shown, fit.residual, self._fitter.correlation_length)
            variance = factor / float(shown @ shown)
            return float(fit.at[-1] ** 2) / variance, math.sqrt(variance), factor
        # all but what is believed of an ordinary parameter could stand in its place: sensitivities
        # that nearly cancel show no serial correlation, what the effect has changed does
        changed = self._base.residual - fit.residual
        factor = hac_variance_factor(changed, fit.residual, self._fitter.correlation_length)
        delta_chi2 = self._base.chi2 - fit.chi2
        return delta_chi2 / factor, math.sqrt(factor / max(information, 1e-9)), factor


def unbelieved(base: Fit, fit: Fit) -> str:
    """Say which ordinary parameter a candidate drives where nobody believes it, or ""."""
    before = {c.name: float(at) for c, at in zip(base.coordinates, base.at, strict=True)}
    for coordinate, at in zip(fit.coordinates, fit.at, strict=True):
        most = UNBELIEVED * coordinate.prior
        if coordinate.name in before and abs(before[coordinate.name]) < most < abs(at):
            share = float(coordinate.value(float(at))) / coordinate.neutral
            return f"{coordinate.name} would have to be {share:.2g} times its configured value"
    return ""


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the candidates in the order of what they explain, the strange ones last.

    Where several explain the training data about equally well, held-out data decide: a law that
    holds elsewhere beats one that bends to its data. Where several do that equally well, too, none
    has bent, and all data count.
    """
    by_delta_chi2 = sorted(trials, key=lambda t: -t.evidence.delta_chi2)
    sound = [t for t in by_delta_chi2 if not t.evidence.strange]
    return _ranked(sound) + [t for t in by_delta_chi2 if t.evidence.strange]


def _ranked(by_delta_chi2: list[Trial]) -> list[Trial]:
    if not by_delta_chi2 or by_delta_chi2[0].evidence.delta_chi2 <= 0.0:
        return by_delta_chi2
    level = CONTENDERS * by_delta_chi2[0].evidence.delta_chi2
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
    return explained >= min(AS_GOOD * best, best - chance)


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
