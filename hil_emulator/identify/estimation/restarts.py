"""Ways on from where a fit has stopped: over kinks, and along directions that hardly matter."""

from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import TOLERATED, Fit, prior_rows
from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter

NUDGES = (0.7, 1.4)
"""Factors of an effect's size at which a refit is begun once more (assumed)."""

MOST_OF_THE_WAY = 0.5
"""Part of the way to zero from which a fit is begun there as well."""

NEARLY_NONE = 0.99
"""Part of the way at which it begins: at the very end, some influences have no derivative."""

LEAST_SEEN = 2
"""Directions along which what is believed decides."""


def nudged(fitter: Fitter, fit: Fit, i: int, enough: float = LEAST_GAIN) -> Fit:
    """Push one effect over the kinks that a delay has at every sample, a lap at every edge.

    Ordinary parameters that have gone far with it start as configured.

    Args:
        fitter: with frozen experiments.
        fit: that may have stopped at a kink.
        i: index of the effect.
        enough: gain in chi-square that is no better fit.

    Returns:
        a better fit, or the same.

    """
    best = fit
    low, high = fit.coordinates[i].bounds
    far = [np.isfinite(c.prior) and abs(a) > TOLERATED * c.prior
           for c, a in zip(fit.coordinates, fit.at, strict=True)]  # fmt: skip
    for factor in NUDGES:
        at = np.where(far, 0.0, fit.at)
        at[i] *= factor
        if low <= at[i] <= high:
            near = None if any(far) else fit.jacobian
            other = fitter.fit(
                fit.coordinates, at, 3, jacobian=near, enough=enough, known=best.chi2
            )
            best = min(best, other, key=lambda f: f.chi2)
    return best


def without_it(fitter: Fitter, fit: Fit) -> Fit:
    """Begin once more without what has gone most of the way to zero.

    Near zero its influence grows with a power: a fit that comes from afar may stop before it.

    Returns:
        a better fit, or the same.

    """
    best = fit
    for i, c in enumerate(fit.coordinates):
        end = c.bounds[0]
        if c.scaling != "vanishing" or not end < fit.at[i] < MOST_OF_THE_WAY * end:
            continue
        at = np.where(np.arange(len(fit.at)) == i, NEARLY_NONE * end, best.at)
        best = min(best, fitter.fit(fit.coordinates, at, 3), key=lambda f: f.chi2)
    return best


def relaxed(fitter: Fitter, fit: Fit) -> Fit:
    """Let what is believed decide along the directions that the data see least.

    Difference quotients are not exact enough to follow them: underlap and overlap, say, act by
    their difference alone.
    """
    pull = prior_rows(fit.coordinates) ** 2
    normal = fit.jacobian.T @ fit.jacobian + np.diag(pull)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
    directions = scale[:, None] * np.linalg.eigh(normal * np.outer(scale, scale))[1]
    low, high = np.array([c.bounds for c in fit.coordinates]).reshape(-1, 2).T
    for way in directions.T[:LEAST_SEEN]:
        reach = float((pull * fit.at) @ way) / max(float((pull * way) @ way), 1e-30)
        for part in (1.0, 0.5):
            at = np.clip(fit.at - part * reach * way, low, high)
            residual = fitter.residual(fit.coordinates, at)
            loss = fitter.loss(fit.coordinates, at, residual)
            if loss < fit.chi2:
                fit = replace(fit, at=at, residual=residual, chi2=loss)
                break
    return fit
