"""The outer iteration: gains and estimates refreshed in turn until the estimate converges."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
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


UNNOTICED = 0.1
"""Change in the same units since gains were computed for which they are not computed anew (assumed:
what they are worth changes with its square)."""


def converge(
    fitter: Fitter, free: Sequence[Coordinate], start: Array,
    effects: Sequence[Coordinate] = (), passes: int = 8,
) -> Fit:  # fmt: skip
    """Refit everything in the model, with gains refreshed, until it hardly moves.

    The Jacobian is kept from one pass to the next; the estimate has converged when a fresh one
    hardly moves it.

    Args:
        fitter: with the training data; its gains are frozen anew.
        free: everything that is fitted.
        start: where it begins.
        effects: those of them that are pushed over kinks.
        passes: most times that the gains are refreshed.

    """
    fit = _settled(fitter, free, start, effects, passes)
    begun = without_it(fitter, fit)
    if begun is not fit:
        fit = _settled(fitter, free, begun.at, effects, passes)
    return relaxed(fitter, fit)


def _settled(
    fitter: Fitter, free: Sequence[Coordinate], start: Array, effects: Sequence[Coordinate],
    passes: int,
) -> Fit:  # fmt: skip
    """Return what a fit becomes from one start."""
    nudging, jacobian, at = bool(effects), None, start
    frozen, spread = np.full(len(start), np.inf), np.ones(len(start))
    for _ in range(passes):
        if _moved(frozen, at, spread) > UNNOTICED or not len(free):
            fitter.freeze(free, at)
            frozen = at
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
    return fit


def _moved(one: Array, other: Array, spread: Array) -> float:
    """Return how far two estimates are apart, in their standard deviations."""
    return float(np.max(np.abs(other - one) / spread, initial=0.0))
