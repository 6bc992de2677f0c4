"""Experiments that share their noise: runs of an emulator with one seed, or one run given twice.

Noise that returns is no second witness: what fits it in one experiment fits it in all of them, the
held-out ones among them. Such experiments count together as one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.errors import UserError
from hil_emulator.identify.measured.experiment import Array, Experiment

SAME_NOISE = 0.5
"""Correlation of two channels' noise from which it is the same: by chance it is a tenth."""

OFFSET_MARGIN = 8
"""Samples around the best offset in which sixth differences of one noise still agree."""

FEWEST_NOISE_SAMPLES = 200
"""Samples from which noise can be compared."""


def counted(
    training: Sequence[Experiment], validation: Sequence[Experiment]
) -> tuple[list[Experiment], list[Experiment]]:
    """Return experiments that know how many share their noise, and say so.

    Raises:
        UserError: if one file is given twice.

    """
    every = [*training, *validation]
    for i, e in enumerate(every):
        if any(_identical(e, other) for other in every[:i]):
            raise UserError(f"{e.name}: given twice; held-out data must be another experiment")
    noises = [_noises(e) for e in every]
    found = []
    for i, e in enumerate(every):
        twins = [every[j].name for j in range(len(every)) if j != i and _same(noises[i], noises[j])]
        if twins:
            note = (
                f"the noise is that of {', '.join(twins)}: an emulator with the same seed; "
                "together they count as one experiment"
            )
            e = replace(e, copies=1 + len(twins), notes=(*e.notes, note))
        found.append(e)
    return found[: len(training)], found[len(training) :]


def _identical(a: Experiment, b: Experiment) -> bool:
    """Tell whether two experiments are the same part of the same file."""
    return bool(
        a.digest and a.digest == b.digest and a.samples == b.samples
        and all(np.array_equal(v, b.readings.get(n, 0.0), equal_nan=True)
                for n, v in a.readings.items())
    )  # fmt: skip


def _noises(e: Experiment) -> dict[str, Array]:
    """Return the noise of each channel that is measured throughout."""
    return {
        name: np.diff(values, 6)
        for name, values in e.readings.items()
        if len(values) >= FEWEST_NOISE_SAMPLES and np.isfinite(values).all()
    }


def _same(a: dict[str, Array], b: dict[str, Array]) -> bool:
    """Tell whether any channel has the same noise in both, whenever each of them began."""
    return any(_likeness(a[name], b[name]) > SAME_NOISE for name in a.keys() & b.keys())


def _likeness(a: Array, b: Array) -> float:
    """Return the correlation of two stretches of noise at the one offset where they agree.

    Signs alone: a jump of the signal would outweigh all noise. What agrees at several offsets is a
    hum, and no noise.
    """
    one, other = (np.sign(x - np.median(x)) for x in (a, b))
    size = 2 ** int(np.ceil(np.log2(len(one) + len(other))))
    product = np.fft.irfft(np.fft.rfft(one, size) * np.conj(np.fft.rfft(other, size)), size)
    peak = int(np.argmax(product))
    around = np.abs(np.arange(size) - peak)
    elsewhere = float(np.max(product[np.minimum(around, size - around) > OFFSET_MARGIN]))
    if elsewhere > 0.5 * product[peak]:
        return 0.0
    return float(product[peak]) / min(len(one), len(other))
