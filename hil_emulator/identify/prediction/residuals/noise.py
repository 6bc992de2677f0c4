"""How noisy channels are, and how large innovations are where nothing is missing."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import SPANS, Array, Experiment, Mask, noise_of

SMALLEST_NOISE = 5e-5
"""Noise of a channel without any, over its span (assumed: rounding of a recording)."""

QUIETEST = 0.25
"""Least standard deviation that whitened innovations are taken to have (assumed): a channel without
noise is as exact as the floor under its noise, not as a rod at rest makes it look."""


def noise_levels(experiment: Experiment, channels: Sequence[str]) -> Array:
    """Return the standard deviation of each channel's noise, from the data themselves."""
    none = np.zeros(0)
    return np.array([max(noise_of(experiment.readings.get(c, none)), SMALLEST_NOISE * SPANS[c])
                     for c in channels])  # fmt: skip


def quiet_rms(values: Array, length: int) -> float:
    """Return the rms that a quarter of the stretches of this length stay below, from `QUIETEST`."""
    if not len(values):
        return QUIETEST
    parts = np.array_split(values, max(1, len(values) // max(length, 1)))
    rms = float(np.quantile([np.sqrt(np.mean(part**2)) for part in parts], 0.25))
    return max(rms, QUIETEST)


def quiet_weights(residual: Array, present: Mask, noise: Array, length: int, copies: int) -> Array:
    """Return the weight of each channel's residuals by how large they are where nothing is missing.

    Args:
        residual: in the channels' units, shape (samples, channels).
        present: whether it counts, of the same shape.
        noise: standard deviation of each channel's noise.
        length: of the stretches that may be quiet, in samples.
        copies: experiments that share this noise.

    """
    quiet = [
        quiet_rms(r[p] / n, length) for r, p, n in zip(residual.T, present.T, noise, strict=True)
    ]
    return np.asarray(1.0 / (np.sqrt(copies) * noise * np.array(quiet)))
