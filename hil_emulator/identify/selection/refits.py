"""Joint refits of the likeliest candidates, alone and in pairs, and by less noise.

A friction that is larger one way and a pressure reading that is off act against each other: each
alone explains little, both together nearly all; taking one at a time would begin with a third.
Noise that is estimated from a residual holds all that the model does not explain, and beside it
nothing is large: where a candidate leaves much less, a round is judged again by that, as the
likelihood ratio of two models with a noise of their own (Seber and Lee 2003, section 4.1).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from hil_emulator.identify.estimation.excerpt import excerpt_of
from hil_emulator.identify.estimation.finite_difference import Derivative
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.estimation.restarts import nudged
from hil_emulator.identify.prediction.parallel.pool import Batch
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import (
    Evidence,
    Trial,
    ranked,
)
from hil_emulator.identify.selection.levels import GREATER_PART, NEARLY_ALL, SMALL_PART
from hil_emulator.identify.selection.progress import Round
from hil_emulator.identify.selection.scan import NO_EFFECT, Pair, Score, score_of

ITERATIONS_AT_ONCE = 5
"""Iterations of a joint refit, before it is asked whether more are worth while."""

MOST_CONTINUATIONS = 4
"""Most times that it goes on."""

WORTHWHILE_PART = 0.01
"""Part of the gain so far that these iterations must have added for it to go on (assumed)."""

LITTLE_PART = 1e-3
"""Part of the gain so far that an iteration must add for another one (assumed)."""

PROMISING = 0.2
"""Part of the best rough gain below which a candidate is not refitted to the end (assumed)."""

PARTNER_ITERATIONS = 3
"""Iterations of a refit with one of a pair."""

STEP_FRACTIONS = (1.0, 0.5)
"""Parts of the way to where the linear model puts a pair, of which one has to lead there: of two
that act against each other, the whole way may be far too long."""

NOISE_PASSES = 4
"""Most refits, each by the noise that the last one has left."""

NOISE_ITERATIONS = 5
"""Of each refit."""


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

    @cached_property
    def _left_before(self) -> float:
        return self._left_of(self._base)

    def _left_of(self, fit: Fit) -> float:
        """Return what a fit leaves of held-out data as a sum of squares, NaN without any."""
        if self._held is None:
            return math.nan
        left = self._fitter.residual(fit.coordinates, fit.at, self._held)
        return float(left @ left)

    def refit(self, likely: Sequence[Score]) -> list[Trial]:
        """Refit candidates, all roughly and the better ones to the end; the best comes first."""
        fits = [self._rough(score).lean() for score in likely]
        self._improve(fits, PROMISING, lambda i: self._complete(fits[i], likely[i].coordinate))
        # further starts are worth while for those that rival the best
        self._improve(fits, GREATER_PART, lambda i: self._pushed(fits[i]))
        fits.reverse()
        return ranked([self.evaluate(score, fits.pop()) for score in likely])

    def _improve(self, fits: list[Fit], part: float, better: Callable[[int], Fit]) -> None:
        """Put a better fit in the place of each that gains at least this part of the best."""
        deltas = [self._base.chi2 - fit.chi2 for fit in fits]
        level = max([self._needed, *(part * delta_chi2 for delta_chi2 in deltas)])
        for i, delta_chi2 in enumerate(deltas):
            if delta_chi2 > level:
                fits[i] = better(i).lean()

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
        """Push the candidate on; of long recordings an excerpt shows whether that leads on."""
        excerpt, last, enough = excerpt_of(self._fitter, fit), len(fit.at) - 1, self._enough(fit)
        if excerpt.rows is None:
            other = nudged(self._fitter, fit, last, enough)
            return fit if other is fit else self._converged(other)
        seen, there = excerpt.fitter, excerpt.fit
        unpushed = seen.fit(fit.coordinates, fit.at, ITERATIONS_AT_ONCE, there.jacobian, enough)
        other = nudged(seen, unpushed, last, enough)
        if unpushed.chi2 - other.chi2 < enough:
            return fit
        begun = self._fitter.fit(fit.coordinates, other.at, 1, fit.jacobian, enough)
        return min(fit, self._converged(begun), key=lambda f: f.chi2)

    def _converged(self, fit: Fit) -> Fit:
        for _ in range(MOST_CONTINUATIONS):
            if fit.converged:  # it would try the same steps once more
                break
            before = fit.chi2
            fit = self._fitter.fit(
                fit.coordinates, fit.at, ITERATIONS_AT_ONCE, jacobian=fit.jacobian,
                enough=self._enough(fit),
            )  # fmt: skip
            if before - fit.chi2 < WORTHWHILE_PART * max(self._base.chi2 - fit.chi2, self._needed):
                break
        return fit

    def _enough(self, fit: Fit) -> float:
        """Return the gain in chi-square of an iteration below which it was the last one."""
        return max(LEAST_GAIN, LITTLE_PART * (self._base.chi2 - fit.chi2))

    def evaluate(self, score: Score, fit: Fit) -> Trial:
        """Judge a candidate by a fit with its knob last."""
        wald, deviation, factor, serial = self._robust_statistics(score.coordinate.name, fit)
        held_out = self._left_before - self._left_of(fit)
        delta_chi2 = self._base.chi2 - fit.chi2
        size = float(fit.at[-1])
        evidence = Evidence(delta_chi2, wald, held_out, self._needed, factor, size, serial)
        return Trial(score.lean(), fit, evidence, deviation)

    def _robust_statistics(self, name: str, fit: Fit) -> tuple[float, float, float, float]:
        """Return Wald statistic and standard deviation of the knob, and its variance factors."""
        last, clusters = len(fit.at) - 1, self._fitter.clusters
        # an effect that is off has no shape: whether it is there does not hang on how it looks
        rest = [i for i, c in enumerate(fit.coordinates[:-1]) if not c.name.startswith(f"{name}.")]
        others = [fit.coordinates[i] for i in rest]
        jacobian = fit.jacobian[:, rest].astype(np.float64)
        project = Projection(Fit(others, fit.at[rest], fit.residual, jacobian, 0.0))
        fresh = self._fitter.column(fit.coordinates, fit.at, fit.residual, last)
        shown, believed = np.split(project(fresh), [len(fit.residual)])
        information = float(shown @ shown + believed @ believed)
        if information <= NO_EFFECT:  # what was gained, something else did
            return 0.0, math.inf, 1.0, 1.0
        if believed @ believed < shown @ shown:
            factor = clusters.variance_factor(shown, fit.residual)
            variance = factor / float(shown @ shown)
            serial = clusters.serial_factor(shown, fit.residual)
            return float(fit.at[-1] ** 2) / variance, math.sqrt(variance), factor, serial
        # all but what is believed of an ordinary parameter could stand in its place: sensitivities
        # that nearly cancel show no serial correlation, what the effect has changed does
        changed = self._base.residual - fit.residual
        factor = clusters.variance_factor(changed, fit.residual)
        delta_chi2 = self._base.chi2 - fit.chi2
        deviation = math.sqrt(factor / information)
        return delta_chi2 / factor, deviation, factor, clusters.serial_factor(changed, fit.residual)


class PairSearch:
    """Tries pairs where one candidate at a time would go astray.

    Args:
        fitter: with the training data frozen.
        base: the fit without any candidate, where the scores were taken.
        held: frozen validation data, or None.
        needed: gain in chi-square that a name needs.

    """

    def __init__(self, fitter: Fitter, base: Fit, held: Batch | None, needed: float) -> None:
        self._fitter, self._base, self._held, self._needed = fitter, base, held, needed

    def first_of_pair(self, pairs: Sequence[Pair], alone: float) -> Trial | None:
        """Return the candidate to begin with, judged beside its partner; None without a pair.

        Args:
            pairs: the likeliest first, see `pairs_of`.
            alone: what the best single candidate gains.

        """
        for pair in pairs:
            if not self._holds(pair):
                continue
            first, second = pair.scores
            trials = [self._beside(first, second), self._beside(second, first)]
            deltas = [self._base.chi2 - t.fit.chi2 for t in trials]
            if all(t.evidence.passed for t in trials) and NEARLY_ALL * min(deltas) > alone:
                best = max(trials, key=lambda t: t.evidence.delta_chi2)
                return replace(best, fit=best.fit.without([best.partner]))
        return None

    def _refits(self, model: Fit) -> CandidateRefits:
        return CandidateRefits(self._fitter, model, self._held, self._needed)

    def _holds(self, pair: Pair) -> bool:
        """Tell whether the model gains most of what its linearisation promises of a pair."""
        base = self._base
        free = [*base.coordinates, *(s.coordinate for s in pair.scores)]
        moved = sum(x * s.response for x, s in zip(pair.sizes, pair.scores, strict=True))
        for way in STEP_FRACTIONS:
            at = np.append(base.at + way * moved, way * np.array(pair.sizes))
            most = base.chi2 - GREATER_PART * way * (2.0 - way) * pair.delta_chi2
            if next(self._fitter.within(free, [at], most)) is not None:
                return True
        return False

    def _beside(self, first: Score, second: Score) -> Trial:
        """Judge a candidate in a model that has another one already."""
        at = np.append(self._base.at, 0.0)
        free = [*self._base.coordinates, first.coordinate]
        model = self._fitter.fit(free, at, PARTNER_ITERATIONS)
        sensitivity = self._fitter.column(
            [*free, second.coordinate], np.append(model.at, 0.0), model.residual, len(free)
        )
        score = score_of(second.coordinate, sensitivity, Projection(model))
        trial = self._refits(model).refit([score])[0]
        return replace(trial, score=second.lean(), partner=first.coordinate.name)


def reweigh_by_best(fitter: Fitter, base: Fit, scores: Sequence[Score]) -> Fit | None:
    """Weigh the training data by the noise that the likeliest candidate leaves; return its fit.

    None, and the weights stay as they are, where they know the noise or it would hardly differ.
    """
    before = fitter.batch.noise
    if before is None or not scores:
        return None
    likeliest = scores[0]
    at = np.append(base.at + likeliest.estimate * likeliest.response, likeliest.estimate)
    fit, noise = fitter.fit([*base.coordinates, likeliest.coordinate], at, NOISE_ITERATIONS), before
    for most in (SMALL_PART, *[NEARLY_ALL] * (NOISE_PASSES - 1)):
        left = noise.left(fit.residual)
        if left.density > most * noise.density:
            break
        fitter.batch, noise = fitter.batch.sharing(left), left
        fit = fitter.fit(fit.coordinates, fit.at, NOISE_ITERATIONS)
    return None if noise is before else fit


def held_out(fitter: Fitter, held: Batch, fit: Fit) -> Batch:
    """Return held-out data weighed by the noise that a fit leaves there."""
    if held.noise is None:
        return held
    return held.sharing(held.noise.left(fitter.residual(fit.coordinates, fit.at, held)))


def significant_with_estimated_noise(found: Round) -> bool:
    """Tell whether the best candidate of a round is named even as its noise is estimated with it.

    Few independent values know a variance badly: the likelihood ratio grows by a logarithm only.
    """
    size = found.base.sample_size
    return size * math.log1p(found.best / size) > found.needed
