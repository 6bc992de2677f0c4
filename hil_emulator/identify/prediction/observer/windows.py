"""Windows and pieces of a long recording, with the gains of the whole recording."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import Gains, Jacobians
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.observer import BURN_IN

WINDOW = 1.0
"""Length of a window [s]: twenty times the excluded time at its start."""

LONGEST = 30_000
"""Samples of a piece: derivatives of five channels by a hundred terms take 60 MB."""

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""Golden ratio: fractional parts of its multiples are evenly distributed (Weyl 1916), and not in
phase with a periodic excitation."""


def first_samples(samples: int, length: int, part: float) -> Index:
    """Return the first samples of windows that cover a part of a recording, one per equal stretch.

    Args:
        samples: of the recording.
        length: of a window, in samples.
        part: of the recording, between 0 and 1.

    """
    count = min(max(1, round(part * samples / length)), samples // length)
    stretch = samples / count
    offsets = (np.arange(count) * GOLDEN) % 1.0
    return np.floor(np.arange(count) * stretch + offsets * (stretch - length)).astype(np.int64)


def window(frozen: Frozen, first: int, last: int) -> Frozen:
    """Return a section of a recording that starts with the state predicted there.

    Memories of set point and sensors are reset; the first samples are excluded.
    """
    data, start, here = frozen.data, frozen.start, slice(first, last)
    settling = data.settling[here].copy()
    settling[: round(BURN_IN / data.period)] = True
    z = frozen.predicted[first].copy()
    state = start.state.copy()
    state[start.active] = z[: len(start.active)]
    shorter = data._replace(
        current=data.current[here], unknown=data.unknown[here], measured=data.measured[here],
        settling=settling,
    )  # fmt: skip
    return replace(
        frozen, data=shorter, start=start._replace(state=state, z=z),
        gains=Gains(*(g[here] for g in frozen.gains)),
        jacobians=Jacobians(*(j[here] for j in frozen.jacobians)),
        predicted=frozen.predicted[here], probed=None,
    )  # fmt: skip


def counted(frozen: Frozen) -> Array:
    """Return a mask of the residuals that are not excluded, flat."""
    channels = frozen.data.measured.shape[1]
    return np.repeat(~frozen.data.settling, channels)


@dataclass(frozen=True)
class Piece:
    """A piece of a long recording, which overlaps with the piece before by the excluded time.

    Attributes:
        frozen: the piece.
        begin: its first sample in the recording.
        end: the sample after its last one.
        repeated: number of samples in common with the piece before.
        last: whether it is the last piece of the recording.

    """

    frozen: Frozen
    begin: int
    end: int
    repeated: int
    last: bool


def pieces(frozen: Frozen) -> Iterator[Piece]:
    """Yield successive pieces of a recording, or the whole one if it is short."""
    samples, settles = len(frozen.data.measured), round(BURN_IN / frozen.data.period)
    if samples <= LONGEST:
        yield Piece(frozen, 0, samples, 0, True)
        return
    for first in range(0, samples, LONGEST):
        begin, end = max(0, first - settles), min(samples, first + LONGEST)
        yield Piece(window(frozen, begin, end), begin, end, first - begin, end == samples)
