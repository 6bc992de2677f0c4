"""The outer iteration: gains and estimates refreshed in turn until the estimate converges."""

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.estimation.restarts import nudged, relaxed
from hil_emulator.identify.selection.progress import Search

CONVERGED = 0.3
"""Change in posterior standard deviations below which an estimate has converged (assumed)."""

LITTLE = 0.03
"""Prior standard deviations that are added to them: long recordings leave next to none, and the
filter does not notice (assumed)."""


def converge(fitter: Fitter, search: Search, passes: int = 8) -> Fit:
    """Refit everything in the model, with gains refreshed, until it hardly moves.

    The Jacobian is kept from one pass to the next; the estimate has converged when a fresh one
    hardly moves it.
    """
    nudging = bool(search.effects)
    jacobian = None
    for _ in range(passes):
        fitter.freeze(search.free, search.at)
        fit = fitter.fit(search.free, search.at, 2, jacobian=jacobian)
        priors = np.array([c.prior if np.isfinite(c.prior) else 0.0 for c in search.free])
        spread = np.sqrt(np.diag(fit.covariance()) + (LITTLE * priors) ** 2 + 1e-30)
        converged = float(np.max(np.abs(fit.at - search.at) / spread, initial=0.0)) < CONVERGED
        search.at = fit.at
        if converged and jacobian is None and not nudging:
            break
        if converged and jacobian is None:
            nudging, start = False, fit
            for effect in search.effects:
                start = nudged(fitter, start, search.free.index(effect))
            search.at = start.at
        else:
            jacobian = None if converged else fit.jacobian
    search.final = fit = relaxed(fitter, fit)
    search.at = fit.at
    return fit
