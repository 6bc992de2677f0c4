"""Refits in which a candidate takes over what drove ordinary parameters far."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.map_fit import TOLERATED, Fit, Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.selection.parts import GREATER_PART
from hil_emulator.identify.selection.scan import Score

TRIED_SIZES = (0.1, 0.3, 1.0, 3.0)
"""Typical sizes at which an effect is tried that its linearisation leads astray (assumed)."""

DEAR = 3.0
"""How much longer than usual a prediction may take for an effect to be tried at any size but its
typical one: a coupling that hardly gives is stiff, and does nothing (assumed)."""

TAKEOVER_ITERATIONS = 3
"""Iterations of that refit."""


class Takeover:
    """Starts for candidates where the gap has driven ordinary parameters far.

    A valve that is fitted slow hides a delay: only where it is as fast as configured does the
    delay explain anything.

    Args:
        fitter: with frozen experiments.
        fit: what the gap has driven.

    """

    def __init__(self, fitter: Fitter, fit: Fit) -> None:
        self._fitter, self._fit = fitter, fit
        self._there = _as_configured(fitter, fit)

    def starts(self, score: Score) -> list[Score]:
        """Return where a refit of a candidate leads from there: one start, or none."""
        there = self._there
        if there is None:
            return []
        free = [*there.coordinates, score.coordinate]
        tries = list(
            tries_of(self._fitter, score, there, (*TRIED_SIZES, *(-k for k in TRIED_SIZES)))
        )
        losses = [(self._fitter.loss(free, at, r), at, r)
                  for at, r in zip(tries, self._fitter.residuals(free, tries), strict=True)
                  ]  # fmt: skip
        loss, at, residual = min(losses, key=lambda t: t[0], default=(np.inf, there.at, None))
        if residual is None or there.chi2 - loss < GREATER_PART * (there.chi2 - self._fit.chi2):
            return []
        jacobian = np.column_stack([there.jacobian, (residual - there.residual) / at[-1]])
        found = self._fitter.fit(free, at, TAKEOVER_ITERATIONS, jacobian=jacobian)
        values = {c.name: a for c, a in zip(free, found.at, strict=True)}
        whole = [*self._fit.coordinates, score.coordinate]
        start = np.array([values.get(c.name, 0.0) for c in whole])
        fit = self._fitter.fit(whole, start, TAKEOVER_ITERATIONS)
        delta_chi2 = self._fit.chi2 - fit.chi2
        return [replace(score, statistic=delta_chi2, estimate=float(fit.at[-1]), start=fit.at)]


def tries_of(fitter: Fitter, score: Score, fit: Fit, sizes: Sequence[float]) -> Iterator[Array]:
    """Yield a fit's coordinates with a candidate at some sizes: those it may have, and not dear."""
    low, high = score.coordinate.bounds
    free = [*fit.coordinates, score.coordinate]
    for size in sizes:
        tried = np.append(fit.at, size)
        dear = abs(size) != 1.0 and fitter.cost(free, tried) > DEAR
        if low <= size <= high and size != 0.0 and not dear:
            yield tried


def _as_configured(fitter: Fitter, fit: Fit) -> Fit | None:
    """Return a fit with the parameters as configured that the gap drove far; None without any."""
    far = [np.isfinite(c.prior) and abs(a) > TOLERATED * c.prior
           for c, a in zip(fit.coordinates, fit.at, strict=True)]  # fmt: skip
    if not any(far):
        return None
    kept = [i for i, driven in enumerate(far) if not driven]
    free, at = [fit.coordinates[i] for i in kept], fit.at[kept]
    residual = fitter.residual(free, at)
    return Fit(free, at, residual, fit.jacobian[:, kept], fitter.loss(free, at, residual))
