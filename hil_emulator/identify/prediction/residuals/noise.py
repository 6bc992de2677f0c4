"""Noise of channels, and size of innovations in the parts of a record without missing effects."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import SPANS, Array, Experiment, Mask, noise_of

SMALLEST_NOISE = 5e-5
"""Smallest noise of a channel, over its span (assumed: rounding of a recording)."""

QUIETEST = 0.25
"""Smallest standard deviation of whitened innovations (assumed); a rod at rest would give less."""


def noise_levels(experiment: Experiment, channels: Sequence[str]) -> Array:
    """Return the standard deviation of each channel's noise, estimated from the data."""
    empty = np.zeros(0)
    return np.array([max(noise_of(experiment.readings.get(c, empty)), SMALLEST_NOISE * SPANS[c])
                     for c in channels])  # fmt: skip


def quiet_rms(values: Array, length: int) -> float:
    """Return the first quartile of the rms over stretches of a length, at least `QUIETEST`."""
    if not len(values):
        return QUIETEST
    parts = np.array_split(values, max(1, len(values) // max(length, 1)))
    rms = float(np.quantile([np.sqrt(np.mean(part**2)) for part in parts], 0.25))
    return max(rms, QUIETEST)


def quiet_weights(residual: Array, present: Mask, noise: Array, length: int, copies: int) -> Array:
    """Return the weight of each channel's residuals, from their size in quiet stretches.

    Args:
        residual: in the channels' units, shape (samples, channels).
        present: mask of residuals that count, of the same shape.
        noise: standard deviation of each channel's noise.
        length: of a stretch, in samples.
        copies: number of experiments with the same noise.

    """
    quiet = [
        quiet_rms(r[p] / n, length) for r, p, n in zip(residual.T, present.T, noise, strict=True)
    ]
    return np.asarray(1.0 / (np.sqrt(copies) * noise * np.array(quiet)))
