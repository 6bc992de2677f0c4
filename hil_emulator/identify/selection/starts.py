"""Which candidates hold in the model itself, and where a refit of each had better begin.

An effect that bends, or that ordinary parameters stand in for, has a linearisation that leads
nowhere: it is tried at several sizes, and with the parameters back where they were configured.
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
"""Expected gain in chi-square below which a candidate is not looked at."""

SECANTS = 2
"""Most of their secants that are followed."""

MOST_SIZE_SEARCHES = 16
"""Most candidates that are tried at several sizes."""

SAME_EFFECT = 0.998
"""Squared cosine between the sensitivities of effects above which one is tried (assumed)."""

TRIED_SIZES = (0.1, 0.3, 1.0, 3.0)
"""Typical sizes at which an effect is tried that its linearisation leads astray (assumed)."""

SLOW_FACTOR = 3.0
"""How much longer than usual a prediction may take for an effect to be tried at any size but its
typical one: a coupling that hardly gives is stiff, and does nothing (assumed)."""

RESTART_ITERATIONS = 3
"""Iterations of a refit that begins with parameters as they are configured."""


class NonlinearCheck:
    """Looks at candidates with the model itself.

    Args:
        fitter: with frozen experiments.
        fit: where the scores were taken.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self._project = Projection(fit)
        self._nuisance_restart = NuisanceRestart(fitter, fit)

    def best(self, scores: Sequence[Score], wanted: int) -> list[Score]:
        """Return the best scores that hold where the linear model puts the estimate.

        An effect that bends, or that is far stronger than its typical size, has a linearisation
        that leads nowhere; its statistic is then what the model gains at the best of a few sizes.
        So is that of a limit, which far away has no linearisation. Of effects with the same
        sensitivity one is enough.

        Args:
            scores: of the linear model.
            wanted: how many are enough.

        """
        found: list[Score] = []
        tried = {i: s for i, s in enumerate(scores) if s.flat}
        begun = [(i, self._nearer(s) if s.flat else s) for i, s in enumerate(scores)]
        queue = [(-s.statistic, i, s) for i, s in begun if s.statistic > LEAST_EXPECTED_GAIN]
        heapq.heapify(queue)
        most = len(tried) + MOST_SIZE_SEARCHES
        while queue and len(found) < wanted and len(tried) < most:
            _, i, score = heapq.heappop(queue)
            if i in tried:
                found.append(score)
                continue
            holds = self._holds(score)
            options = [score] if holds else []
            if not any(_alike(score, other) for other in (*tried.values(), *found)):
                options += self._nuisance_restart.starts(score)
                options += [] if holds else self._size_search(score)
            best = max(options, key=lambda s: s.statistic, default=score)
            if best is score and holds:
                found.append(score)
                continue
            tried[i] = score
            if options and best.statistic > LEAST_EXPECTED_GAIN:
                heapq.heappush(queue, (-best.statistic, i, best))
        return found + self._same_stage(found, [s for i, s in enumerate(scores) if i not in tried])

    def masked_by_nuisance(
        self, scores: Sequence[Score], likely: Sequence[Score], wanted: int
    ) -> list[Score]:
        """Return the likely candidates, with those that parameters driven far stand in for.

        Beside such parameters the effect explains nothing; where they are as configured, the most.

        Args:
            scores: of the linear model.
            likely: the best of them.
            wanted: how many more are enough.

        """
        there = self._nuisance_restart.there
        if there is None:
            return list(likely)
        known = {s.coordinate.name for s in likely}
        of = {s.coordinate.name: s for s in scores if s.coordinate.name not in known}
        best = scan(self._fitter, there, [s.coordinate for s in of.values()])[:wanted]
        starts = [s for b in best for s in self._nuisance_restart.starts(of[b.coordinate.name])]
        return [*likely, *(s for s in starts if s.statistic > LEAST_EXPECTED_GAIN)]

    def _nearer(self, limit: Score) -> Score:
        """Return where a limit explains the most; it gains nothing where it hardly acts."""
        return max(self._size_search(limit), key=lambda s: s.statistic, default=limit)

    def _same_stage(self, found: Sequence[Score], rest: Sequence[Score]) -> list[Score]:
        """Return effects that act at the place in the model at which the best one does.

        Of two that do the same, the linearisation of one may lead somewhere, the other's nowhere.
        """
        best = max(found, key=lambda s: s.statistic, default=None)
        if best is None or best.coordinate.channel or best.statistic < LEAST_EXPECTED_GAIN:
            return []
        known = {s.coordinate.name for s in found}
        kin = [s for s in rest if s.coordinate.name not in known
               and s.coordinate.stage == best.coordinate.stage]  # fmt: skip
        starts = [max(self._size_search(s), key=lambda o: o.statistic, default=s) for s in kin]
        return [s for s in starts if s.statistic > GREATER_PART * best.statistic]

    def _holds(self, score: Score) -> bool:
        """Tell whether the model gains most of what its linearisation promises."""
        return self._deltas([score], GREATER_PART * score.statistic)[0] > -math.inf

    def _deltas(self, scores: Sequence[Score], least: float = 0.0) -> list[float]:
        """Return what the model itself gains where scores of one candidate put its estimate.

        A gain below the least is minus infinity.
        """
        fit, fitter = self._fit, self._fitter
        free = [*fit.coordinates, scores[0].coordinate]
        points = [np.append(fit.at + s.estimate * s.response, s.estimate) for s in scores]
        dear = [abs(p[-1]) < TRIED_SIZES[1] and fitter.cost(free, p) > SLOW_FACTOR for p in points]
        tried = [p for p, costs in zip(points, dear, strict=True) if not costs]
        deltas = self._deltas_at(free, tried, fit.chi2 - least)
        return [-math.inf if costs else next(deltas) for costs in dear]

    def _deltas_at(
        self, free: Sequence[Coordinate], points: Sequence[Array], most: float
    ) -> Iterator[float]:
        for found in self._fitter.within(free, points, most):
            yield -math.inf if found is None else self._fit.chi2 - found[1]

    def _size_search(self, score: Score) -> list[Score]:
        """Return starts at several sizes, and where the most promising secants to them lead.

        Between sizes that explain something, all may be worse.
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


def _alike(one: Score, other: Score) -> bool:
    """Return whether no data like these tell two candidates apart."""
    product = float(one.column @ other.column)
    return product**2 > SAME_EFFECT * one.information * other.information


class NuisanceRestart:
    """Starts for candidates where the gap has driven ordinary parameters far.

    A valve that is fitted slow hides a delay: only where it is as fast as configured does the
    delay explain anything.

    Args:
        fitter: with frozen experiments.
        fit: what the gap has driven.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self.there = as_configured(fitter, fit)

    def starts(self, score: Score) -> list[Score]:
        """Return where a refit of a candidate leads from there: one start, or none."""
        there = self.there
        if there is None:
            return []
        free = [*there.coordinates, score.coordinate]
        tries = list(
            trial_points(self._fitter, score, there, (*TRIED_SIZES, *(-k for k in TRIED_SIZES)))
        )
        most = there.chi2 - GREATER_PART * (there.chi2 - self._fit.chi2)
        found = zip(tries, self._fitter.within(free, tries, most), strict=True)
        losses = [(t[1], at, t[0]) for at, t in found if t is not None]
        if not losses:
            return []
        _, at, residual = min(losses, key=lambda t: t[0])
        jacobian = np.column_stack([there.jacobian, (residual - there.residual) / at[-1]])
        taken = self._fitter.fit(free, at, RESTART_ITERATIONS, jacobian=jacobian)
        values = {c.name: a for c, a in zip(free, taken.at, strict=True)}
        whole = [*self._fit.coordinates, score.coordinate]
        start = np.array([values.get(c.name, 0.0) for c in whole])
        fit = self._fitter.fit(whole, start, RESTART_ITERATIONS)
        delta_chi2 = self._fit.chi2 - fit.chi2
        return [replace(score, statistic=delta_chi2, estimate=float(fit.at[-1]), start=fit.at)]


def trial_points(fitter: Fitter, score: Score, fit: Fit, sizes: Sequence[float]) -> Iterator[Array]:
    """Yield a fit's coordinates with a candidate at some sizes: those it may have, and not dear."""
    low, high = score.coordinate.bounds
    free = [*fit.coordinates, score.coordinate]
    for size in sizes:
        tried = np.append(fit.at, size)
        dear = abs(size) != 1.0 and fitter.cost(free, tried) > SLOW_FACTOR
        if low <= size <= high and size != 0.0 and not dear:
            yield tried


def as_configured(fitter: Fitter, fit: Fit) -> Fit | None:
    """Return a fit with the parameters as configured that the gap drove far; None without any."""
    far = [np.isfinite(c.prior) and abs(a) > TOLERATED * c.prior
           for c, a in zip(fit.coordinates, fit.at, strict=True)]  # fmt: skip
    if not any(far):
        return None
    kept = [i for i, driven in enumerate(far) if not driven]
    free, at = [fit.coordinates[i] for i in kept], fit.at[kept]
    residual = fitter.residual(free, at)
    return Fit(free, at, residual, fit.jacobian[:, kept], fitter.loss(free, at, residual))
