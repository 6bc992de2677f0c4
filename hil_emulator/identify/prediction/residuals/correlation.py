"""Autocorrelation of residuals, and the effective number of independent values.

The information of a record does not depend on its sample rate: the variance of its mean is the
spectral density of the residual at zero frequency over the record's length. The density is the sum
of the autocovariances, truncated by the initial monotone sequence (Geyer 1992, section 3.3); it is
common to all experiments of a channel.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve

from hil_emulator.identify.measured.experiment import Array, Mask

LONGEST = 0.1
"""Largest lag, as a share of an experiment."""

BLOCK_OVER_MEMORY = 2.0
"""Length of a block over the correlation time. For first-order noise, whose correlation becomes
insignificant after three time constants, such blocks contain five sixths of the variance."""

PARTS = 5
"""Number of lags in the shortest block; residuals are summed within each."""

CHANCE = 2.0
"""Standard errors within which an autocorrelation is not significant (p = 0.05)."""

LEAST = 1e-9
"""Smallest standard deviation of a residual, in its unit (assumed; for exact data)."""


@dataclass(frozen=True)
class Correlogram:
    """Sums of lagged products of one experiment's residual.

    Attributes:
        period: of the samples [s].
        samples: number of samples.
        copies: number of experiments with the same noise.
        products: sum of the products of values, by lag in samples.
        pairs: number of products, by lag.

    """

    period: float
    samples: int
    copies: int
    products: Array
    pairs: Array


@dataclass(frozen=True)
class Noise:
    """Common noise of all experiments of a channel.

    Attributes:
        density: spectral density at zero frequency: variance times the time per independent value
            [unit^2 s].
        memory: correlation time [s].
        sample_size: effective number of independent values.
        correlograms: of each experiment.

    """

    density: float
    memory: float
    sample_size: float
    correlograms: tuple[Correlogram, ...]

    def weight(self, period: float, copies: int) -> float:
        """Return the weight for which the sum of squared residuals counts independent values."""
        return float(np.sqrt(period / (self.density * copies)))

    def left(self, residual: Array) -> "Noise":
        """Return the noise of another model.

        Args:
            residual: of that model for all experiments, flat, weighted with this noise.

        """
        ends = np.cumsum([c.samples for c in self.correlograms])[:-1]
        return shared([
            replace(c, products=_products(r / self.weight(c.period, c.copies), len(c.pairs)))
            for c, r in zip(self.correlograms, np.split(residual, ends), strict=True)
        ])  # fmt: skip


def block_time(residuals: Sequence[Array], periods: Sequence[float], least: float) -> float:
    """Return the length of nearly independent blocks of residuals [s].

    Twice the correlation time of the channel with the longest one: the lag at which the
    autocorrelation is no longer significant, p = 0.05 (Bartlett 1946, Supplement to the Journal of
    the Royal Statistical Society 8, 27-41).

    Args:
        residuals: of each experiment, shape (samples, channels), zero where missing.
        periods: of their samples [s].
        least: shortest block [s].

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
    """Return the correlation time of one channel [s]."""
    correlograms = [correlogram(v, v != 0.0, step) for v, step in zip(series, steps, strict=True)]
    step = max(steps)
    covariance = _covariance(correlograms, step)
    values = sum(float(c.pairs[0]) for c in correlograms)
    if covariance[0] <= 0.0 or not values:
        return 0.0
    lost = covariance <= covariance[0] * CHANCE / np.sqrt(values)
    return step * float(np.argmax(lost) if lost.any() else len(lost))


def correlogram(residual: Array, present: Mask, period: float, copies: int = 1) -> Correlogram:
    """Return the sums of products of a residual by lag.

    Args:
        residual: of one experiment, zero where missing.
        present: mask of present residuals.
        period: of the samples [s].
        copies: number of experiments with the same noise.

    """
    lags = max(2, int(LONGEST * len(residual)))
    pairs = np.round(_products(present.astype(np.float64), lags))
    return Correlogram(period, len(residual), copies, _products(residual, lags), pairs)


def _products(values: Array, lags: int) -> Array:
    """Return the sums of products of values, by lag."""
    return np.asarray(fftconvolve(values, values[::-1])[len(values) - 1 :][:lags])


def shared(correlograms: Sequence[Correlogram]) -> Noise:
    """Return the common noise of several experiments, independent of their order."""
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
    """Return the autocovariance at multiples of a time step, for lags that all experiments have."""
    count = min(int(len(c.pairs) * c.period / step) for c in correlograms)
    products, weights = np.zeros(max(count, 2)), np.zeros(max(count, 2))
    for c in correlograms:
        at = np.minimum(np.round(np.arange(len(weights)) * step / c.period), len(c.pairs) - 1)
        products += c.period * c.products[at.astype(np.int64)]
        weights += c.period * c.pairs[at.astype(np.int64)]
    return np.asarray(np.where(weights > 0.0, products / np.maximum(weights, 1e-30), 0.0))
