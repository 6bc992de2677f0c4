"""Which candidates hold in the model itself, and where a refit of them had better begin."""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.naming.fit import TOLERATED, Fit, Fitter
from hil_emulator.identify.naming.gate import SMALLEST_GAIN
from hil_emulator.identify.naming.scan import Projection, Score, score_of
from hil_emulator.identify.prediction.twin import Coordinate

WORTHLESS = 8.0
"""Expected gain in chi-square below which a candidate is not looked at."""

KEPT = 0.5
"""Part of the gain that the linear model expects which the model itself must show (assumed)."""

SIZES = (0.1, 0.3, 1.0, 3.0)
"""Typical sizes at which an effect is tried that its slope leads astray (assumed)."""

SECANTS = 2
"""Most of their secants that are followed."""

LOOKS = 16
"""Most candidates that are tried at several sizes."""

TAKEN_OVER = 0.5
"""Part of what is lost with parameters as configured that a candidate must make up for, to be
refitted there (assumed)."""

RETURNS = 3
"""Iterations of that refit."""

DEAR = 3.0
"""How much longer than usual a prediction may take for an effect to be tried at any size but its
typical one: a coupling that hardly gives is stiff, and does nothing (assumed)."""

SAME = 0.998
"""Squared cosine between the traces of effects above which they are the same (assumed)."""


class Confirmation:
    """Looks at candidates with the model itself.

    Args:
        fitter: with frozen experiments.
        fit: where the scores were taken.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self._project = Projection(fit)
        self._returned = _returned(fitter, fit)

    def best(self, scores: Sequence[Score], wanted: int) -> list[Score]:
        """Return the best scores that hold where the linear model puts the estimate.

        An effect that bends, or that is far stronger than its typical size, gets a slope that leads
        nowhere; its statistic is then what the model gains at the best of a few sizes. Of effects
        with the same trace one is enough.

        Args:
            scores: of the linear model.
            wanted: how many are enough.

        """
        queue = [(-s.statistic, i, s) for i, s in enumerate(scores) if s.statistic > WORTHLESS]
        heapq.heapify(queue)
        found: list[Score] = []
        tried: dict[int, Score] = {}
        while queue and len(found) < wanted and len(tried) < LOOKS:
            _, i, score = heapq.heappop(queue)
            if i in tried:
                found.append(score)
                continue
            holds = self._gained(score) >= KEPT * score.statistic
            options = [score] if holds else []
            if not any(_alike(score, other) for other in (*tried.values(), *found)):
                options += self._returning(score)
                options += [] if holds else self._sounding(score)
            best = max(options, key=lambda s: s.statistic, default=score)
            if best is score and holds:
                found.append(score)
                continue
            tried[i] = score
            if options and best.sensible and best.statistic > WORTHLESS:
                heapq.heappush(queue, (-best.statistic, i, best))
        return found + self._kin(found, [s for i, s in enumerate(scores) if i not in tried])

    def _kin(self, found: Sequence[Score], rest: Sequence[Score]) -> list[Score]:
        """Return effects that act at the place in the model at which the best one does.

        Of two that do the same, the slope of one may lead somewhere and that of the other nowhere.
        """
        best = max(found, key=lambda s: s.statistic, default=None)
        if best is None or best.coordinate.channel or best.statistic < SMALLEST_GAIN:
            return []
        known = {s.coordinate.name for s in found}
        kin = [s for s in rest if s.coordinate.name not in known and _stage(s) == _stage(best)]
        starts = [max(self._sounding(s), key=lambda o: o.statistic, default=s) for s in kin]
        return [s for s in starts if s.statistic > KEPT * best.statistic]

    def _gained(self, score: Score) -> float:
        return self._gains([score])[0]

    def _gains(self, scores: Sequence[Score]) -> list[float]:
        """Return what the model itself gains where scores of one candidate put its estimate."""
        fit, fitter = self._fit, self._fitter
        free = [*fit.coordinates, scores[0].coordinate]
        points = [np.append(fit.at + s.estimate * s.response, s.estimate) for s in scores]
        dear = [abs(p[-1]) < SIZES[1] and fitter.cost(free, p) > DEAR for p in points]
        tried = [p for p, costs in zip(points, dear, strict=True) if not costs]
        gains = self._gains_at(free, tried)
        return [float("-inf") if costs else next(gains) for costs in dear]

    def _gains_at(self, free: Sequence[Coordinate], points: Sequence[Array]) -> Iterator[float]:
        residuals = self._fitter.residuals(free, points)
        for at, residual in zip(points, residuals, strict=True):
            yield self._fit.chi2 - self._fitter.loss(free, at, residual)

    def _sounding(self, score: Score) -> list[Score]:
        """Return starts at several sizes, and where the most promising secants to them lead.

        Between sizes that explain something, all may be worse.
        """
        sense = -1.0 if score.estimate < 0.0 else 1.0
        fit = self._fit
        free = [*fit.coordinates, score.coordinate]
        tries = list(self._tries(score, fit, (score.estimate, *(sense * k for k in SIZES))))
        starts, secants = [], []
        for at, residual in zip(tries, self._fitter.residuals(free, tries), strict=True):
            gained = fit.chi2 - self._fitter.loss(free, at, residual)
            starts.append(replace(score, statistic=gained, estimate=float(at[-1]), start=at))
            slope = (residual - fit.residual) / at[-1]
            secants.append(score_of(score.coordinate, slope, self._project))
        secants = sorted(secants, key=lambda s: -s.statistic)[:SECANTS]
        gains = self._gains(secants) if secants else []
        return starts + [replace(s, statistic=g) for s, g in zip(secants, gains, strict=True)]

    def _returning(self, score: Score) -> list[Score]:
        """Return where a refit leads in which parameters stay as configured that the gap drove far.

        There the candidate may take over what it was that drove them.
        """
        there = self._returned
        if there is None:
            return []
        sizes = (*SIZES, *(-k for k in SIZES))
        free = [*there.coordinates, score.coordinate]
        tries = list(self._tries(score, there, sizes))
        residuals = self._fitter.residuals(free, tries)
        losses = [(self._fitter.loss(free, at, r), at, r)
                  for at, r in zip(tries, residuals, strict=True)]  # fmt: skip
        loss, at, residual = min(losses, key=lambda t: t[0], default=(np.inf, there.at, None))
        if residual is None or there.chi2 - loss < TAKEN_OVER * (there.chi2 - self._fit.chi2):
            return []
        slopes = np.column_stack([there.jacobian, (residual - there.residual) / at[-1]])
        found = self._fitter.fit(free, at, RETURNS, jacobian=slopes)
        values = {c.name: a for c, a in zip(free, found.at, strict=True)}
        names = [c.name for c in (*self._fit.coordinates, score.coordinate)]
        start = np.array([values.get(name, 0.0) for name in names])
        whole = self._fitter.fit([*self._fit.coordinates, score.coordinate], start, RETURNS)
        gained = self._fit.chi2 - whole.chi2
        return [replace(score, statistic=gained, estimate=float(whole.at[-1]), start=whole.at)]

    def _tries(self, score: Score, fit: Fit, sizes: Sequence[float]) -> Iterator[Array]:
        low, high = score.coordinate.bounds
        free = [*fit.coordinates, score.coordinate]
        for size in sizes:
            tried = np.append(fit.at, size)
            dear = abs(size) != 1.0 and self._fitter.cost(free, tried) > DEAR
            if low <= size <= high and size != 0.0 and not dear:
                yield tried


def _returned(fitter: Fitter, fit: Fit) -> Fit | None:
    """Return a fit with the parameters as configured that the gap drove far; None without any."""
    far = [np.isfinite(c.prior) and abs(a) > TOLERATED * c.prior
           for c, a in zip(fit.coordinates, fit.at, strict=True)]  # fmt: skip
    if not any(far):
        return None
    kept = [i for i, driven in enumerate(far) if not driven]
    free, at = [fit.coordinates[i] for i in kept], fit.at[kept]
    residual = fitter.residual(free, at)
    return Fit(free, at, residual, fit.jacobian[:, kept], fitter.loss(free, at, residual))


def _stage(score: Score) -> str:
    """Return the stage of the model at which an effect acts."""
    effect = score.coordinate.effect
    return effect.stage.name if effect else ""


def _alike(one: Score, other: Score) -> bool:
    """Return whether no data like these tell two candidates apart."""
    product = float(one.column @ other.column)
    return product**2 > SAME * one.information * other.information
