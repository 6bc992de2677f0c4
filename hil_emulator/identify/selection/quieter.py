"""A gap that an effect closes is no noise: candidates judged by what the best of them leaves.

Noise that is estimated from a residual holds all that the model does not explain, and beside it
nothing is large. So where a candidate leaves much less, the round is judged again by that: the
likelihood ratio of two models with a noise of their own (Seber and Lee 2003, section 4.1).
"""

import math
from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.prediction.pool import Batch
from hil_emulator.identify.selection.parts import SMALL_PART
from hil_emulator.identify.selection.progress import Round
from hil_emulator.identify.selection.scan import Score

SETTLED = 0.8
"""Part of it that a further refit leaves, from which it is settled (assumed)."""

PASSES = 4
"""Most refits, each by the noise that the last one has left."""

ITERATIONS = 5
"""Of each refit."""


def quietest(fitter: Fitter, base: Fit, scores: Sequence[Score]) -> Fit | None:
    """Weigh the training data by the noise that the likeliest candidate leaves; return its fit.

    None, and the weights stay as they are, where they know the noise or it would hardly differ.
    """
    before = fitter.batch.noise
    likeliest = next((s for s in scores if s.sensible), None)
    if before is None or likeliest is None:
        return None
    at = np.append(base.at + likeliest.estimate * likeliest.response, likeliest.estimate)
    fit, noise = fitter.fit([*base.coordinates, likeliest.coordinate], at, ITERATIONS), before
    for most in (SMALL_PART, *[SETTLED] * (PASSES - 1)):
        left = noise.left(fit.residual)
        if left.density > most * noise.density:
            break
        fitter.batch, noise = fitter.batch.sharing(left), left
        fit = fitter.fit(fit.coordinates, fit.at, ITERATIONS)
    return None if noise is before else fit


def held_out(fitter: Fitter, held: Batch, fit: Fit) -> Batch:
    """Return held-out data weighed by the noise that a fit leaves there."""
    if held.noise is None:
        return held
    return held.sharing(held.noise.left(fitter.residual(fit.coordinates, fit.at, held)))


def certain(found: Round) -> bool:
    """Tell whether the best candidate of a round is named even as its noise is estimated with it.

    Few independent values know a variance badly: the likelihood ratio grows by a logarithm only.
    """
    size = found.base.sample_size
    return size * math.log1p(found.best / size) > found.needed
