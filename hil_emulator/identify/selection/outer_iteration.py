"""Where everything in the model comes to rest."""

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.estimation.restarts import nudged, relaxed
from hil_emulator.identify.selection.progress import Search

SETTLED = 0.3
"""Change in posterior standard deviations below which a fit has settled (assumed)."""

LITTLE = 0.03
"""Prior standard deviations that are added to them: long recordings leave next to none, and the
filter does not notice (assumed)."""


def settle(fitter: Fitter, search: Search, passes: int = 8) -> Fit:
    """Refit everything in the model, with gains refreshed, until it hardly moves.

    Slopes are kept from one pass to the next; it has settled when fresh ones hardly move it.
    """
    nudging = bool(search.effects)
    slope = None
    for _ in range(passes):
        fitter.freeze(search.free, search.at)
        fit = fitter.fit(search.free, search.at, 2, jacobian=slope)
        priors = np.array([c.prior if np.isfinite(c.prior) else 0.0 for c in search.free])
        spread = np.sqrt(np.diag(fit.covariance()) + (LITTLE * priors) ** 2 + 1e-30)
        settled = float(np.max(np.abs(fit.at - search.at) / spread, initial=0.0)) < SETTLED
        search.at = fit.at
        if settled and slope is None and not nudging:
            break
        if settled and slope is None:
            nudging, start = False, fit
            for effect in search.effects:
                start = nudged(fitter, start, search.free.index(effect))
            search.at = start.at
        else:
            slope = None if settled else fit.jacobian
    search.final = fit = relaxed(fitter, fit)
    search.at = fit.at
    return fit
