"""Experiments with the same noise: emulator runs with one seed, or one run given twice.

A parameter that fits the noise of one copy fits it in all, also in held-out data. So experiments
with the same noise count as one experiment.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import combinations
from typing import Any

import numpy as np
from scipy.fft import irfft, rfft

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array, Experiment, Mask

SAME_NOISE = 0.5
"""Correlation of two channels' noise from which it is the same; by chance it reaches 0.1."""

OFFSET_MARGIN = 8
"""Samples around the best offset within which sixth differences of the same noise correlate."""

FEWEST_NOISE_SAMPLES = 200
"""Samples needed to compare noise."""


_Spectrum = np.ndarray[Any, np.dtype[np.complex128]]


def counted(
    training: Sequence[Experiment], validation: Sequence[Experiment]
) -> tuple[list[Experiment], list[Experiment]]:
    """Return the experiments with the number of those that share their noise, and a note on it.

    Raises:
        UserError: if one file is given twice.

    """
    every = [*training, *validation]
    for i, e in enumerate(every):
        if any(_identical(e, other) for other in every[:i]):
            raise UserError(f"{e.name}: given twice; held-out data must be another experiment")
    same = _same_noise([_noises(e) for e in every])
    experiments = []
    for i, e in enumerate(every):
        twins = [other.name for j, other in enumerate(every) if same[i, j]]
        if twins:
            note = (
                f"the noise is that of {', '.join(twins)}: an emulator with the same seed; "
                "together they count as one experiment"
            )
            e = replace(e, copies=1 + len(twins), notes=(*e.notes, note))
        experiments.append(e)
    return experiments[: len(training)], experiments[len(training) :]


def _identical(a: Experiment, b: Experiment) -> bool:
    """Return whether two experiments are the same part of the same file."""
    return bool(
        a.digest and a.digest == b.digest and a.samples == b.samples
        and all(np.array_equal(v, b.readings.get(n, 0.0), equal_nan=True)
                for n, v in a.readings.items())
    )  # fmt: skip


def _noises(e: Experiment) -> dict[str, Array]:
    """Return the noise of each channel without missing samples, as sixth differences."""
    return {
        name: np.diff(values, 6)
        for name, values in e.readings.items()
        if len(values) >= FEWEST_NOISE_SAMPLES and np.isfinite(values).all()
    }


def _same_noise(noises: Sequence[dict[str, Array]]) -> Mask:
    """Return which experiments share the noise of a channel, at any offset in time.

    Returns:
        Shape (experiments, experiments); the diagonal is False.

    """
    same = np.zeros((len(noises), len(noises)), np.bool_)
    for name in sorted(set().union(*noises)):
        # one channel at a time: the spectra of all channels would fill the memory
        signs = {i: _signs(channels[name]) for i, channels in enumerate(noises) if name in channels}
        spectrum = cache(partial(_spectrum, signs))
        for i, j in combinations(signs, 2):
            lengths = len(signs[i]), len(signs[j])
            size = 2 ** math.ceil(math.log2(sum(lengths)))
            most = _most(spectrum(i, size), spectrum(j, size))
            if most > SAME_NOISE * min(lengths):
                same[i, j] = same[j, i] = True
    return same


def _signs(noise: Array) -> Array:
    """Return the signs: with values, one jump of the signal would outweigh the noise."""
    return np.asarray(np.sign(noise - np.median(noise)))


def _spectrum(signs: Mapping[int, Array], i: int, size: int) -> _Spectrum:
    return np.asarray(rfft(signs[i], size))


def _most(one: _Spectrum, other: _Spectrum) -> float:
    """Return the product of two stretches at the only offset where they correlate, or 0.

    Stretches that correlate at several offsets contain hum instead of the same noise.
    """
    product = irfft(one * np.conj(other))
    peak = int(np.argmax(product))
    most = float(product[peak])
    product[np.arange(peak - OFFSET_MARGIN, peak + OFFSET_MARGIN + 1) % len(product)] = 0.0
    return most if float(product.max()) <= 0.5 * most else 0.0
