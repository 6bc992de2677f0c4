"""How residuals are correlated over time, and how many independent values they are worth.

A record of a given length says the same at any sample rate: its mean scatters by the spectral
density of the residual at zero frequency over the record's length, and so do the estimates. The
density is the sum of autocovariances up to where they are lost in chance, by the initial monotone
sequence (Geyer 1992, section 3.3); all experiments of a channel share it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve

from hil_emulator.identify.measured.experiment import Array, Mask

LONGEST = 0.1
"""Part of an experiment up to which lags are looked at."""

BLOCK_OVER_MEMORY = 2.0
"""Length of a block over the time for which residuals are correlated: of a noise with one lag,
which is lost in chance after three times that, such blocks show five sixths of the variance."""

PARTS = 5
"""Parts of the shortest block in which residuals are added up: as many lags tell it."""

CHANCE = 2.0
"""Standard deviations of an autocorrelation within which it is chance, in 19 of 20 cases."""

LEAST = 1e-9
"""Least standard deviation of a residual, in its unit (assumed: an exact one has none)."""


@dataclass(frozen=True)
class Correlogram:
    """What one experiment tells of the correlation of its residual.

    Attributes:
        period: of its samples [s].
        samples: their number.
        copies: experiments that share its noise, itself included.
        products: sum of the products of values that are as many samples apart as the index says.
        pairs: their number.

    """

    period: float
    samples: int
    copies: int
    products: Array
    pairs: Array


@dataclass(frozen=True)
class Noise:
    """What the residuals of all experiments of a channel have in common.

    Attributes:
        density: spectral density at zero frequency, variance times the time in which it yields one
            independent value [unit^2 s].
        memory: time over which values are correlated [s].
        sample_size: number of independent values that the data are worth.
        seen: what each experiment told.

    """

    density: float
    memory: float
    sample_size: float
    seen: tuple[Correlogram, ...]

    def weight(self, period: float, copies: int) -> float:
        """Return the weight of a residual, so that the sum of squares counts independent values."""
        return float(np.sqrt(period / (self.density * copies)))

    def left(self, residual: Array) -> "Noise":
        """Return the noise that another explanation leaves.

        Args:
            residual: of that, of all experiments, flat, in the weights of this noise.

        """
        ends = np.cumsum([c.samples for c in self.seen])[:-1]
        return shared([
            replace(c, products=_products(r / self.weight(c.period, c.copies), len(c.pairs)))
            for c, r in zip(self.seen, np.split(residual, ends), strict=True)
        ])  # fmt: skip


def block_time(residuals: Sequence[Array], periods: Sequence[float], least: float) -> float:
    """Return how long blocks of residuals have to be to be worth one independent value each [s].

    Residuals are correlated until their autocorrelation is one that white noise has in one of
    twenty cases (Bartlett 1946, Supplement to the Journal of the Royal Statistical Society 8,
    27-41), of the channel that remembers longest.

    Args:
        residuals: of each experiment, shape (samples, channels), zero where there is none.
        periods: of their samples [s].
        least: shortest blocks [s]; within a part of such a one, residuals are added up.

    """
    widths = [max(1, round(least / PARTS / period)) for period in periods]
    added = [
        np.add.reduceat(residual, np.arange(0, len(residual), width))
        for residual, width in zip(residuals, widths, strict=True)
    ]
    steps = [width * period for width, period in zip(widths, periods, strict=True)]
    channels = zip(*(a.T for a in added), strict=True)
    memory = max((_remembered(list(channel), steps) for channel in channels), default=0.0)
    shortest = min(len(r) * period for r, period in zip(residuals, periods, strict=True))
    return max(least, min(BLOCK_OVER_MEMORY * memory, LONGEST * shortest))


def _remembered(series: Sequence[Array], steps: Sequence[float]) -> float:
    """Return for how long the values of one channel stay correlated [s]."""
    seen = [correlogram(v, v != 0.0, step) for v, step in zip(series, steps, strict=True)]
    step = max(steps)
    covariance = _covariance(seen, step)
    values = sum(float(c.pairs[0]) for c in seen)
    if covariance[0] <= 0.0 or not values:
        return 0.0
    lost = covariance <= covariance[0] * CHANCE / np.sqrt(values)
    return step * float(np.argmax(lost) if lost.any() else len(lost))


def correlogram(residual: Array, present: Mask, period: float, copies: int = 1) -> Correlogram:
    """Return the sums of products of a residual by lag.

    Args:
        residual: of one experiment, zero where there is none.
        present: where there is one.
        period: of the samples [s].
        copies: experiments that share its noise, itself included.

    """
    lags = max(2, int(LONGEST * len(residual)))
    pairs = np.round(_products(present.astype(np.float64), lags))
    return Correlogram(period, len(residual), copies, _products(residual, lags), pairs)


def _products(values: Array, lags: int) -> Array:
    """Return the sum of products of values by how far they are apart."""
    return np.asarray(fftconvolve(values, values[::-1])[len(values) - 1 :][:lags])


def shared(correlograms: Sequence[Correlogram]) -> Noise:
    """Return the noise that several experiments have in common, whatever their order."""
    step = max(c.period for c in correlograms)
    covariance = _covariance(correlograms, step)
    variance = max(float(covariance[0]), LEAST**2)
    even = len(covariance) // 2 * 2
    sums = covariance[:even].reshape(-1, 2).sum(axis=1)
    end = int(np.argmax(sums <= 0.0)) if (sums <= 0.0).any() else len(sums)
    total = float(np.sum(np.minimum.accumulate(sums[:end])))
    density = step * max(2.0 * total - variance, variance)
    power = sum(c.period * float(c.products[0]) for c in correlograms)
    size = max(power / density, 1.0)
    return Noise(density, 2.0 * step * max(end, 1), size, tuple(correlograms))


def _covariance(correlograms: Sequence[Correlogram], step: float) -> Array:
    """Return the autocovariance at multiples of a time step, as far as all experiments tell."""
    count = min(int(len(c.pairs) * c.period / step) for c in correlograms)
    products, weights = np.zeros(max(count, 2)), np.zeros(max(count, 2))
    for c in correlograms:
        at = np.minimum(np.round(np.arange(len(weights)) * step / c.period), len(c.pairs) - 1)
        products += c.period * c.products[at.astype(np.int64)]
        weights += c.period * c.pairs[at.astype(np.int64)]
    return np.asarray(np.where(weights > 0.0, products / np.maximum(weights, 1e-30), 0.0))
