"""Check of candidates with the nonlinear model, and starting points of their refits.

The linearisation fails for a strongly nonlinear effect, and for one that is masked by ordinary
parameters. Such candidates are evaluated at several sizes, and with these parameters reset.
"""

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import TOLERATED, Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import GREATER_PART
from hil_emulator.identify.selection.scan import Score, scan, score_of

LEAST_EXPECTED_GAIN = 8.0
"""Expected gain in chi-square below which a candidate is not evaluated."""

SECANTS = 2
"""Largest number of secants per candidate whose estimates are evaluated."""

MOST_SIZE_SEARCHES = 16
"""Largest number of candidates that are evaluated at several sizes."""

SAME_EFFECT = 0.998
"""Squared cosine of two sensitivities above which one of the effects is evaluated (assumed)."""

TRIED_SIZES = (0.1, 0.3, 1.0, 3.0)
"""Sizes at which a strongly nonlinear effect is evaluated, in typical sizes (assumed)."""

SLOW_FACTOR = 3.0
"""Ratio to the computing time without the effect above which a size other than the typical one is
skipped: a nearly rigid coupling makes the model stiff and has no effect (assumed)."""

RESTART_ITERATIONS = 3
"""Iterations of a refit from configured parameters."""


class NonlinearCheck:
    """Evaluates candidates with the nonlinear model.

    Args:
        fitter: with frozen experiments.
        fit: at which the scores were computed.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self._project = Projection(fit)
        self._nuisance_restart = NuisanceRestart(fitter, fit)

    def best(self, scores: Sequence[Score], wanted: int) -> list[Score]:
        """Return the best scores whose gain the nonlinear model confirms.

        If the gain at the linear estimate is too small, the statistic becomes the gain at the best
        of a few sizes. The same applies to inactive limits. Of effects with collinear
        sensitivities only the first is evaluated at several sizes.

        Args:
            scores: of the linear model.
            wanted: number of scores after which the check ends.

        """
        confirmed: list[Score] = []
        tried = {i: s for i, s in enumerate(scores) if s.flat}
        begun = [(i, self._nearer(s) if s.flat else s) for i, s in enumerate(scores)]
        queue = [(-s.statistic, i, s) for i, s in begun if s.statistic > LEAST_EXPECTED_GAIN]
        heapq.heapify(queue)
        most = len(tried) + MOST_SIZE_SEARCHES
        while queue and len(confirmed) < wanted and len(tried) < most:
            _, i, score = heapq.heappop(queue)
            if i in tried:
                confirmed.append(score)
                continue
            holds = self._holds(score)
            options = [score] if holds else []
            if not any(_collinear(score, other) for other in (*tried.values(), *confirmed)):
                options += self._nuisance_restart.starts(score)
                options += [] if holds else self._size_search(score)
            best = max(options, key=lambda s: s.statistic, default=score)
            if best is score and holds:
                confirmed.append(score)
                continue
            tried[i] = score
            if options and best.statistic > LEAST_EXPECTED_GAIN:
                heapq.heappush(queue, (-best.statistic, i, best))
        rest = [s for i, s in enumerate(scores) if i not in tried]
        return confirmed + self._same_stage(confirmed, rest)

    def masked_by_nuisance(
        self, scores: Sequence[Score], likely: Sequence[Score], wanted: int
    ) -> list[Score]:
        """Return the likely candidates and those that implausible parameters mask.

        A masked effect explains nothing until the implausible parameters are reset to their
        configured values.

        Args:
            scores: of the linear model.
            likely: the best of them.
            wanted: largest number of further candidates.

        """
        reset = self._nuisance_restart.reset
        if reset is None:
            return list(likely)
        listed = {s.coordinate.name for s in likely}
        others = {s.coordinate.name: s for s in scores if s.coordinate.name not in listed}
        best = scan(self._fitter, reset, [s.coordinate for s in others.values()])[:wanted]
        starts = [s for b in best for s in self._nuisance_restart.starts(others[b.coordinate.name])]
        return [*likely, *(s for s in starts if s.statistic > LEAST_EXPECTED_GAIN)]

    def _nearer(self, limit: Score) -> Score:
        """Return the score of an inactive limit at the size with the largest gain."""
        return max(self._size_search(limit), key=lambda s: s.statistic, default=limit)

    def _same_stage(self, confirmed: Sequence[Score], rest: Sequence[Score]) -> list[Score]:
        """Return effects in the stage of the best one that explain much of the same residual.

        The linear screening may miss one of two similar effects, if only its own linearisation
        fails.
        """
        best = max(confirmed, key=lambda s: s.statistic, default=None)
        if best is None or best.coordinate.channel or best.statistic < LEAST_EXPECTED_GAIN:
            return []
        listed = {s.coordinate.name for s in confirmed}
        others = [s for s in rest if s.coordinate.name not in listed
                  and s.coordinate.stage == best.coordinate.stage]  # fmt: skip
        starts = [max(self._size_search(s), key=lambda o: o.statistic, default=s) for s in others]
        return [s for s in starts if s.statistic > GREATER_PART * best.statistic]

    def _holds(self, score: Score) -> bool:
        """Return whether the model gains most of what its linearisation predicts."""
        return self._deltas([score], GREATER_PART * score.statistic)[0] > -math.inf

    def _deltas(self, scores: Sequence[Score], least: float = 0.0) -> list[float]:
        """Return the nonlinear gain in chi-square at each score's estimate of one candidate.

        A gain below `least` is minus infinity, and so is that of an expensive small size.
        """
        fit, fitter = self._fit, self._fitter
        free = [*fit.coordinates, scores[0].coordinate]
        points = [np.append(fit.at + s.estimate * s.response, s.estimate) for s in scores]
        most = SLOW_FACTOR * fitter.cost(fit.coordinates, fit.at)
        slow = [abs(p[-1]) < TRIED_SIZES[1] and fitter.cost(free, p) > most for p in points]
        tried = [p for p, skipped in zip(points, slow, strict=True) if not skipped]
        deltas = self._deltas_at(free, tried, fit.chi2 - least)
        return [-math.inf if skipped else next(deltas) for skipped in slow]

    def _deltas_at(
        self, free: Sequence[Coordinate], points: Sequence[Array], most: float
    ) -> Iterator[float]:
        for evaluated in self._fitter.within(free, points, most):
            yield -math.inf if evaluated is None else self._fit.chi2 - evaluated[1]

    def _size_search(self, score: Score) -> list[Score]:
        """Return starting points at several sizes, and the estimates of the best secants to them.

        The chi-square may have several local minima over the size.
        """
        sense = -1.0 if score.estimate < 0.0 else 1.0
        fit = self._fit
        free = [*fit.coordinates, score.coordinate]
        sizes = (score.estimate, *(sense * k for k in TRIED_SIZES))
        tries = list(trial_points(self._fitter, score, fit, sizes))
        starts, secants = [], []
        for at, residual in zip(tries, self._fitter.residuals(free, tries), strict=True):
            delta_chi2 = fit.chi2 - self._fitter.loss(free, at, residual)
            starts.append(replace(score, statistic=delta_chi2, estimate=float(at[-1]), start=at))
            secant = (residual - fit.residual) / at[-1]
            secants.append(score_of(score.coordinate, secant, self._project))
        secants = sorted(secants, key=lambda s: -s.statistic)[:SECANTS]
        deltas = self._deltas(secants) if secants else []
        return starts + [replace(s, statistic=d) for s, d in zip(secants, deltas, strict=True)]


def _collinear(one: Score, other: Score) -> bool:
    """Return whether the sensitivities of two candidates are nearly collinear."""
    product = float(one.column @ other.column)
    return product**2 > SAME_EFFECT * one.information * other.information


class NuisanceRestart:
    """Refits of candidates from configured values of implausible ordinary parameters.

    A missing delay, for instance, lowers the fitted bandwidth of the valve, and then explains
    nothing more until the bandwidth is reset.

    Args:
        fitter: with frozen experiments.
        fit: possibly with implausible parameters.

    Attributes:
        reset: the fit without its implausible parameters; None without any.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self.reset = as_configured(fitter, fit)

    def starts(self, score: Score) -> list[Score]:
        """Return the refit of a candidate from the reset fit, as a score, if it improves that."""
        reset = self.reset
        if reset is None:
            return []
        free = [*reset.coordinates, score.coordinate]
        tries = list(
            trial_points(self._fitter, score, reset, (*TRIED_SIZES, *(-k for k in TRIED_SIZES)))
        )
        most = reset.chi2 - GREATER_PART * (reset.chi2 - self._fit.chi2)
        evaluated = zip(tries, self._fitter.within(free, tries, most), strict=True)
        losses = [(t[1], at, t[0]) for at, t in evaluated if t is not None]
        if not losses:
            return []
        _, at, residual = min(losses, key=lambda t: t[0])
        jacobian = np.column_stack([reset.jacobian, (residual - reset.residual) / at[-1]])
        restarted = self._fitter.fit(free, at, RESTART_ITERATIONS, jacobian=jacobian)
        values = {c.name: a for c, a in zip(free, restarted.at, strict=True)}
        whole = [*self._fit.coordinates, score.coordinate]
        start = np.array([values.get(c.name, 0.0) for c in whole])
        fit = self._fitter.fit(whole, start, RESTART_ITERATIONS)
        delta_chi2 = self._fit.chi2 - fit.chi2
        return [replace(score, statistic=delta_chi2, estimate=float(fit.at[-1]), start=fit.at)]


def trial_points(fitter: Fitter, score: Score, fit: Fit, sizes: Sequence[float]) -> Iterator[Array]:
    """Yield a fit's coordinates with a candidate at each feasible size that is not expensive."""
    low, high = score.coordinate.bounds
    free = [*fit.coordinates, score.coordinate]
    most = SLOW_FACTOR * fitter.cost(fit.coordinates, fit.at)
    for size in sizes:
        point = np.append(fit.at, size)
        slow = abs(size) != 1.0 and fitter.cost(free, point) > most
        if low <= size <= high and size != 0.0 and not slow:
            yield point


def as_configured(fitter: Fitter, fit: Fit) -> Fit | None:
    """Return a fit without its implausible parameters, which get their configured values.

    Returns None if no parameter is farther than `TOLERATED` standard deviations off.
    """
    implausible = [np.isfinite(c.prior) and abs(a) > TOLERATED * c.prior
                   for c, a in zip(fit.coordinates, fit.at, strict=True)]  # fmt: skip
    if not any(implausible):
        return None
    kept = [i for i, dropped in enumerate(implausible) if not dropped]
    free, at = [fit.coordinates[i] for i in kept], fit.at[kept]
    residual = fitter.residual(free, at)
    return Fit(free, at, residual, fit.jacobian[:, kept], fitter.loss(free, at, residual))
