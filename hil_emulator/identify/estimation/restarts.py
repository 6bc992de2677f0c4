"""Restarts of a converged fit: across kinks of the loss, near zero, and along flat directions."""

from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import TOLERATED, Fit, prior_rows
from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter

NUDGES = (0.7, 1.4)
"""Factors on an effect's size for a restart (assumed)."""

MOST_OF_THE_WAY = 0.5
"""Fraction of the distance to zero above which a coordinate is restarted near zero."""

NEARLY_ZERO = 0.99
"""Fraction of that distance at the restart: at zero itself the derivative may be zero."""

FLAT_DIRECTIONS = 2
"""Number of flat directions along which the priors decide."""


def nudged(fitter: Fitter, fit: Fit, i: int, enough: float = LEAST_GAIN) -> Fit:
    """Restart a fit with one effect displaced, across kinks of the loss.

    A delay has a kink at every sample, a valve lap at every edge. Implausible ordinary parameters
    start at their configured values.

    Args:
        fitter: with frozen experiments.
        fit: that may have stopped at a kink.
        i: index of the effect.
        enough: gain in chi-square below which an iteration is the last one.

    Returns:
        A better fit, or the same one.

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
                fit.coordinates, at, 3, jacobian=near, enough=enough, reference=best.chi2
            )
            best = min(best, other, key=lambda f: f.chi2)
    return best


def restarted_near_zero(fitter: Fitter, fit: Fit) -> Fit:
    """Restart a fit near zero for each vanishing coordinate that is on the way there.

    Near zero the influence of such a coordinate is a power of it, so that a fit may stop early.

    Returns:
        A better fit, or the same one.

    """
    best = fit
    for i, c in enumerate(fit.coordinates):
        end = c.bounds[0]
        if c.scaling != "vanishing" or not end < fit.at[i] < MOST_OF_THE_WAY * end:
            continue
        at = np.where(np.arange(len(fit.at)) == i, NEARLY_ZERO * end, best.at)
        best = min(best, fitter.fit(fit.coordinates, at, 3), key=lambda f: f.chi2)
    return best


def moved_to_priors(fitter: Fitter, fit: Fit) -> Fit:
    """Move a fit to the optimum of the priors along the directions with the least information.

    Finite differences are too inaccurate for Gauss-Newton steps along them. Example: underlap and
    overlap act by their difference alone.
    """
    pull = prior_rows(fit.coordinates) ** 2
    normal = fit.jacobian.T @ fit.jacobian + np.diag(pull)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
    directions = scale[:, None] * np.linalg.eigh(normal * np.outer(scale, scale))[1]
    low, high = np.array([c.bounds for c in fit.coordinates]).reshape(-1, 2).T
    for direction in directions.T[:FLAT_DIRECTIONS]:
        slope, curvature = (pull * fit.at) @ direction, (pull * direction) @ direction
        length = float(slope) / max(float(curvature), 1e-30)
        for part in (1.0, 0.5):
            at = np.clip(fit.at - part * length * direction, low, high)
            residual = fitter.residual(fit.coordinates, at)
            loss = fitter.loss(fit.coordinates, at, residual)
            if loss < fit.chi2:
                fit = replace(fit, at=at, residual=residual, chi2=loss)
                break
    return fit
