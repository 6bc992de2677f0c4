"""Outer iteration of a fit: filter gains and estimates are updated in turn until convergence."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.estimation.restarts import moved_to_priors, nudged, restarted_near_zero
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

CONVERGED = 0.3
"""Change in posterior standard deviations below which an estimate has converged (assumed)."""

FAR = 5.0
"""Change in the same units above which a Jacobian is recomputed (assumed)."""

LITTLE = 0.03
"""Share of the prior standard deviation that is added to these units: smaller changes do not matter
to the filter, even if long recordings make the posterior narrower (assumed)."""


PARTS = (1.0, 0.3, 0.1)
"""Fractions of a step that are tried until the deviance with the new gains is smaller (assumed)."""

AT_THE_END = 5
"""Iterations of each of two final fits with the same gains: a candidate must not gain by continuing
an unfinished fit."""

PROGRESS = 0.01
"""Decrease of the deviance per residual and pass above which a pass is not counted (assumed)."""

UNNOTICED = 0.1
"""Change in the same units up to which gains are not recomputed (assumed; their effect is
quadratic)."""


def converge(
    fitter: Fitter, free: Sequence[Coordinate], start: Array,
    effects: Sequence[Coordinate] = (), passes: int = 8, last: Fit | None = None,
) -> Fit:  # fmt: skip
    """Fit all coordinates of the model, with updated filter gains, until convergence.

    The Jacobian is kept between passes; the estimate has converged if a recomputed Jacobian hardly
    changes it.

    Args:
        fitter: with the training data; its filter gains are recomputed.
        free: coordinates of the fit.
        start: their starting values.
        effects: those of them that are displaced once, since the loss has kinks along them.
        passes: largest number of updates of the gains with little progress.
        last: earlier fit of some of these coordinates, the others being zero. The result is not
            worse.

    """
    best = _iterated(fitter, free, start, effects, passes, last)
    restarted = restarted_near_zero(fitter, best)
    if restarted is not best:
        other = _iterated(fitter, free, restarted.at, effects, passes)
        if other.deviance > best.deviance and best.frozen is not None:
            fitter.freeze(free, best.frozen)
        else:
            best = other
    return moved_to_priors(fitter, best)


def _iterated(
    fitter: Fitter, free: Sequence[Coordinate], start: Array, effects: Sequence[Coordinate],
    passes: int, last: Fit | None = None,
) -> Fit:  # fmt: skip
    """Return the fit after the outer iteration from one starting point."""
    nudging, jacobian, at = bool(effects), None, start
    frozen, best = _starting_point(free, last)
    spread, left, fit = np.ones(len(start)), passes, None
    while left > 0 or fit is None:
        left -= 1
        if fit is None or _moved(frozen, at, spread) > UNNOTICED or not len(free):
            before = best
            at, best, worse = _frozen_on(fitter, free, frozen, at, best)
            frozen = at
            if worse:
                fit = fitter.fit(free, at, AT_THE_END)
                fit = fitter.fit(free, fit.at, AT_THE_END)
                break
            if fit is not None and before - best > PROGRESS * len(fit.residual):
                left += 1
        fit = fitter.fit(free, at, 2, jacobian=jacobian)
        priors = np.array([c.prior if np.isfinite(c.prior) else 0.0 for c in free])
        spread = np.sqrt(np.diag(fit.covariance()) + (LITTLE * priors) ** 2 + 1e-30)
        moved = _moved(at, fit.at, spread)
        converged, at = moved < CONVERGED, fit.at
        if converged and jacobian is None and not nudging:
            break
        if converged and jacobian is None:
            nudging, displaced = False, fit
            for effect in effects:
                displaced = nudged(fitter, displaced, list(free).index(effect))
            if displaced is fit:
                break
            at = displaced.at
        else:
            jacobian = None if converged or moved > FAR else fit.jacobian
    return replace(fit, frozen=frozen, deviance=best)


def _starting_point(free: Sequence[Coordinate], last: Fit | None) -> tuple[Array, float]:
    """Return the point of the last fit's gains, and its deviance; infinite if unknown."""
    names = {c.name for c in free}
    if last is None or last.frozen is None or not {c.name for c in last.coordinates} <= names:
        return np.full(len(free), np.inf), math.inf
    values = dict(zip([c.name for c in last.coordinates], last.frozen.tolist(), strict=True))
    return np.array([values.get(c.name, 0.0) for c in free]), last.deviance


def _frozen_on(
    fitter: Fitter, free: Sequence[Coordinate], last: Array, at: Array, best: float
) -> tuple[Array, float, bool]:
    """Recompute the filter gains at the end of a step, shortened until the deviance decreases.

    The step minimises the loss for the gains at its start. With the gains at its end, which differ
    for a long step, the deviance may increase.

    Args:
        fitter: with the training data.
        free: coordinates of the fit.
        last: point of the present gains.
        at: end of the step.
        best: deviance at `last`; infinite before the first step.

    Returns:
        Point of the new gains, its deviance, and whether no fraction of the step was better.

    """
    for part in PARTS if np.isfinite(best) else PARTS[:1]:
        tried = last + part * (at - last) if part < 1.0 else at
        fitter.freeze(free, tried)
        deviance = fitter.deviance(free, tried)
        if not deviance > best + LEAST_GAIN:
            return tried, deviance, False
    fitter.freeze(free, last)
    return last, best, True


def _moved(one: Array, other: Array, spread: Array) -> float:
    """Return the largest difference of two estimates, in standard deviations."""
    return float(np.max(np.abs(other - one) / spread, initial=0.0))
