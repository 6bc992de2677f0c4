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
