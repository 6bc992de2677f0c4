"""Joint refits of the likeliest candidates, alone and in pairs, and with re-estimated noise.

Two effects that cancel each other explain little alone and nearly all of the residual together; a
purely greedy search would begin with a third effect. Noise that is estimated from the residual
includes missing effects. If a candidate leaves much less noise, its gain is therefore tested with
the smaller noise (likelihood ratio of two models, each with its own noise variance; Seber and Lee
2003, section 4.1).
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
"""Iterations of a joint refit between two tests of convergence."""

MOST_CONTINUATIONS = 4
"""Largest number of such blocks of iterations."""

WORTHWHILE_PART = 0.01
"""Share of the gain so far that a block must add for another block (assumed)."""

LITTLE_PART = 1e-3
"""Share of the gain so far that an iteration must add for another iteration (assumed)."""

PROMISING = 0.2
"""Share of the best preliminary gain below which a refit is not continued (assumed)."""

PARTNER_ITERATIONS = 3
"""Iterations of a fit with one candidate of a pair."""

STEP_FRACTIONS = (1.0, 0.5)
"""Fractions of the step to the linear joint estimate of a pair; one of them must improve the fit.
The full step may be too long for effects that cancel each other."""

NOISE_PASSES = 4
"""Largest number of refits with re-estimated noise."""

NOISE_ITERATIONS = 5
"""Iterations of each of these refits."""


class CandidateRefits:
    """Refits candidates together with all coordinates of the model.

    Args:
        fitter: with the training data frozen.
        base: fit without any of the candidates.
        held: frozen validation data, or None.
        needed: critical value of the gain in chi-square.

    """

    def __init__(self, fitter: Fitter, base: Fit, held: Batch | None, needed: float) -> None:
        self._fitter, self._base, self._held = fitter, base, held
        self._needed = needed

    @cached_property
    def _held_out_base(self) -> float:
        return self._held_out_chi2(self._base)

    def _held_out_chi2(self, fit: Fit) -> float:
        """Return the sum of squared residuals of the validation data; NaN without any."""
        if self._held is None:
            return math.nan
        residual = self._fitter.residual(fit.coordinates, fit.at, self._held)
        return float(residual @ residual)

    def refit(self, likely: Sequence[Score]) -> list[Trial]:
        """Refit all candidates preliminarily and the promising ones to convergence; rank them."""
        fits = [self._preliminary(score).lean() for score in likely]
        self._improve(fits, PROMISING, lambda i: self._complete(fits[i], likely[i].coordinate))
        # a restart is worth its time only for rivals of the best candidate
        self._improve(fits, GREATER_PART, lambda i: self._pushed(fits[i]))
        fits.reverse()
        return ranked([self.evaluate(score, fits.pop()) for score in likely])

    def _improve(self, fits: list[Fit], part: float, better: Callable[[int], Fit]) -> None:
        """Replace each fit that has at least this share of the best gain by a better one."""
        deltas = [self._base.chi2 - fit.chi2 for fit in fits]
        level = max([self._needed, *(part * delta_chi2 for delta_chi2 in deltas)])
        for i, delta_chi2 in enumerate(deltas):
            if delta_chi2 > level:
                fits[i] = better(i).lean()

    def _preliminary(self, score: Score) -> Fit:
        base = self._base
        free = [*base.coordinates, score.coordinate]
        if score.start is not None:
            return self._fitter.fit(free, score.start, 2)
        at = np.append(base.at + score.estimate * score.response, score.estimate)
        jacobian = np.column_stack([base.jacobian, score.sensitivity])
        return self._fitter.fit(free, at, 2, jacobian=jacobian)

    def _complete(self, fit: Fit, coordinate: Coordinate) -> Fit:
        """Refit with the shape parameters of the effect's law as further coordinates."""
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
        """Restart from a displaced candidate; for long recordings only if an excerpt improves."""
        excerpt, last, enough = excerpt_of(self._fitter, fit), len(fit.at) - 1, self._enough(fit)
        if excerpt.rows is None:
            other = nudged(self._fitter, fit, last, enough)
            return fit if other is fit else self._converged(other)
        start = excerpt.fit.jacobian
        unpushed = excerpt.fitter.fit(fit.coordinates, fit.at, ITERATIONS_AT_ONCE, start, enough)
        other = nudged(excerpt.fitter, unpushed, last, enough)
        if unpushed.chi2 - other.chi2 < enough:
            return fit
        restarted = self._fitter.fit(fit.coordinates, other.at, 1, fit.jacobian, enough)
        return min(fit, self._converged(restarted), key=lambda f: f.chi2)

    def _converged(self, fit: Fit) -> Fit:
        for _ in range(MOST_CONTINUATIONS):
            if fit.converged:
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
        """Return the gain in chi-square of an iteration below which the refit ends."""
        return max(LEAST_GAIN, LITTLE_PART * (self._base.chi2 - fit.chi2))

    def evaluate(self, score: Score, fit: Fit) -> Trial:
        """Return the trial of a candidate.

        Args:
            score: of the candidate.
            fit: with the candidate's knob as the last coordinate.

        """
        wald, deviation, factor, serial = self._robust_statistics(score.coordinate.name, fit)
        held_out = self._held_out_base - self._held_out_chi2(fit)
        delta_chi2 = self._base.chi2 - fit.chi2
        size = float(fit.at[-1])
        evidence = Evidence(delta_chi2, wald, held_out, self._needed, factor, size, serial)
        return Trial(score.lean(), fit, evidence, deviation)

    def _robust_statistics(self, name: str, fit: Fit) -> tuple[float, float, float, float]:
        """Return Wald statistic, standard deviation, variance factor and serial factor of a knob.

        Shape parameters of the effect are fixed: they do not exist under the null hypothesis.
        """
        last, clusters = len(fit.at) - 1, self._fitter.clusters
        rest = [i for i, c in enumerate(fit.coordinates[:-1]) if not c.name.startswith(f"{name}.")]
        others = [fit.coordinates[i] for i in rest]
        jacobian = fit.jacobian[:, rest].astype(np.float64)
        project = Projection(Fit(others, fit.at[rest], fit.residual, jacobian, 0.0))
        fresh = self._fitter.column(fit.coordinates, fit.at, fit.residual, last)
        from_data, from_priors = np.split(project(fresh), [len(fit.residual)])
        information = float(from_data @ from_data + from_priors @ from_priors)
        if information <= NO_EFFECT:  # the gain is due to other coordinates
            return 0.0, math.inf, 1.0, 1.0
        if from_priors @ from_priors < from_data @ from_data:
            factor = clusters.variance_factor(from_data, fit.residual)
            variance = factor / float(from_data @ from_data)
            serial = clusters.serial_factor(from_data, fit.residual)
            return float(fit.at[-1] ** 2) / variance, math.sqrt(variance), factor, serial
        # only priors separate the effect from ordinary parameters: the small rest of the
        # sensitivity shows no serial correlation, but the change of the residual does
        changed = self._base.residual - fit.residual
        factor = clusters.variance_factor(changed, fit.residual)
        delta_chi2 = self._base.chi2 - fit.chi2
        deviation = math.sqrt(factor / information)
        return delta_chi2 / factor, deviation, factor, clusters.serial_factor(changed, fit.residual)


class PairSearch:
    """Search of pairs, for effects that explain little without each other.

    Args:
        fitter: with the training data frozen.
        base: fit without any candidate, at which the scores were computed.
        held: frozen validation data, or None.
        needed: critical value of the gain in chi-square.

    """

    def __init__(self, fitter: Fitter, base: Fit, held: Batch | None, needed: float) -> None:
        self._fitter, self._base, self._held, self._needed = fitter, base, held, needed

    def first_of_pair(self, pairs: Sequence[Pair], alone: float) -> Trial | None:
        """Return the better candidate of the first accepted pair, or None.

        Its evidence is that of adding it to a model with its partner.

        Args:
            pairs: the likeliest first, see `pairs_of`.
            alone: gain in chi-square of the best single candidate.

        """
        for pair in pairs:
            if not self._holds(pair):
                continue
            first, second = pair.scores
            trials = [self._added_to(first, second), self._added_to(second, first)]
            deltas = [self._base.chi2 - t.fit.chi2 for t in trials]
            if all(t.evidence.passed for t in trials) and NEARLY_ALL * min(deltas) > alone:
                best = max(trials, key=lambda t: t.evidence.delta_chi2)
                return replace(best, fit=best.fit.without([best.partner]))
        return None

    def _refits(self, model: Fit) -> CandidateRefits:
        return CandidateRefits(self._fitter, model, self._held, self._needed)

    def _holds(self, pair: Pair) -> bool:
        """Return whether the model gains most of what its linearisation predicts for a pair."""
        base = self._base
        free = [*base.coordinates, *(s.coordinate for s in pair.scores)]
        response = sum(x * s.response for x, s in zip(pair.sizes, pair.scores, strict=True))
        for step in STEP_FRACTIONS:
            at = np.append(base.at + step * response, step * np.array(pair.sizes))
            most = base.chi2 - GREATER_PART * step * (2.0 - step) * pair.delta_chi2
            if next(self._fitter.within(free, [at], most)) is not None:
                return True
        return False

    def _added_to(self, first: Score, second: Score) -> Trial:
        """Return the trial of the second candidate in a model with the first one."""
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
    """Weight the training data with the noise that is left with the likeliest candidate.

    Returns:
        The fit with that candidate; None, with unchanged weights, if the noise is not estimated or
        hardly becomes smaller.

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
    """Return held-out data weighted with the noise that is left with a fit."""
    if held.noise is None:
        return held
    return held.sharing(held.noise.left(fitter.residual(fit.coordinates, fit.at, held)))


def significant_with_estimated_noise(current: Round) -> bool:
    """Return whether the best candidate is significant if its model has a noise of its own.

    The likelihood ratio with two estimated variances is n log(1 + gain / n), which matters for a
    small number n of independent values.
    """
    size = current.base.sample_size
    return size * math.log1p(current.best / size) > current.needed
