"""The outer iteration: gains and estimates refreshed in turn until the estimate converges."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.estimation.restarts import nudged, relaxed, without_it
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

CONVERGED = 0.3
"""Change in posterior standard deviations below which an estimate has converged (assumed)."""

FAR = 5.0
"""Change in the same units after which a Jacobian is computed anew (assumed: a stale one leads
nowhere, which costs as much)."""

LITTLE = 0.03
"""Prior standard deviations that are added to them: long recordings leave next to none, and the
filter does not notice (assumed)."""


PARTS = (1.0, 0.3, 0.1)
"""Parts of a step that are tried until one is better with the gains of its end (assumed)."""

AT_THE_END = 5
"""Iterations of a fit whose gains stay, twice: a candidate must gain nothing by continuing it."""

PROGRESS = 0.01
"""Fall in deviance per residual from one pass to the next above which a fit is still on its way
(assumed)."""

UNNOTICED = 0.1
"""Change in the same units since gains were computed for which they are not computed anew (assumed:
what they are worth changes with its square)."""


def converge(
    fitter: Fitter, free: Sequence[Coordinate], start: Array,
    effects: Sequence[Coordinate] = (), passes: int = 8, last: Fit | None = None,
) -> Fit:  # fmt: skip
    """Refit everything in the model, with gains refreshed, until it hardly moves.

    The Jacobian is kept from one pass to the next; the estimate has converged when a fresh one
    hardly moves it.

    Args:
        fitter: with the training data; its gains are frozen anew.
        free: everything that is fitted.
        start: where it begins.
        effects: those of them that are pushed over kinks.
        passes: most times that the gains are refreshed with little progress.
        last: a fit of some of these coordinates, the others zero: no worse one is returned.

    """
    best = _settled(fitter, free, start, effects, passes, last)
    begun = without_it(fitter, best)
    if begun is not best:
        other = _settled(fitter, free, begun.at, effects, passes)
        if other.deviance > best.deviance and best.frozen is not None:
            fitter.freeze(free, best.frozen)
        else:
            best = other
    return relaxed(fitter, best)


def _settled(
    fitter: Fitter, free: Sequence[Coordinate], start: Array, effects: Sequence[Coordinate],
    passes: int, last: Fit | None = None,
) -> Fit:  # fmt: skip
    """Return what a fit becomes from one start, or from a part of the way there."""
    nudging, jacobian, at = bool(effects), None, start
    frozen, best = _begun(free, last)
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
            nudging, begun = False, fit
            for effect in effects:
                begun = nudged(fitter, begun, list(free).index(effect))
            if begun is fit:
                break
            at = begun.at
        else:
            jacobian = None if converged or moved > FAR else fit.jacobian
    return replace(fit, frozen=frozen, deviance=best)


def _begun(free: Sequence[Coordinate], last: Fit | None) -> tuple[Array, float]:
    """Return where gains were computed last, and the deviance there; infinite where unknown."""
    names = {c.name for c in free}
    if last is None or last.frozen is None or not {c.name for c in last.coordinates} <= names:
        return np.full(len(free), np.inf), math.inf
    values = dict(zip([c.name for c in last.coordinates], last.frozen.tolist(), strict=True))
    return np.array([values.get(c.name, 0.0) for c in free]), last.deviance


def _frozen_on(
    fitter: Fitter, free: Sequence[Coordinate], last: Array, at: Array, best: float
) -> tuple[Array, float, bool]:
    """Freeze the experiments on the way to a point, as far as that is better than the last one.

    A step is the best one for the gains of the point where it begins: far away, where the filter
    believes its model less or more, the whole of it may be worse.

    Args:
        fitter: with the training data.
        free: everything that is fitted.
        last: where they were frozen last.
        at: where the step leads.
        best: deviance at the last point; infinite at the start.

    Returns:
        where they are frozen, the deviance there, and whether no part of the step was better.

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
    """Return how far two estimates are apart, in their standard deviations."""
    return float(np.max(np.abs(other - one) / spread, initial=0.0))
