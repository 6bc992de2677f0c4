"""The filter of an analogue input (CiA 404, objects 0x61A0 and 0x61A1)."""

from collections import deque
from enum import IntEnum


class FilterType(IntEnum):
    """Values of 0x61A0."""

    NONE = 0
    MOVING_AVERAGE = 1
    REPEATING_AVERAGE = 2


class Averaging:
    """Averages the last n samples in each tick, or n samples in every n-th.

    y_k = (x_k + ... + x_(k-n+1)) / n. The moving average has a gain of 1 at rest and a delay of
    (n - 1) / 2 ticks. The first n - 1 outputs average the samples so far.

    Args:
        kind: off, moving or repeating; see `FilterType`.
        count: number of samples n, at least 1.

    """

    def __init__(self, kind: int, count: int) -> None:
        self._kind = kind
        self._count = 1 if kind == FilterType.NONE else max(1, count)
        self._samples: deque[float] = deque(maxlen=self._count)
        self._shown: float | None = None

    def __call__(self, sample: float) -> float:
        """Take a sample and return the filter's output."""
        if self._count == 1:
            return sample
        samples = self._samples
        samples.append(sample)
        if self._kind == FilterType.MOVING_AVERAGE:
            return sum(samples) / len(samples)
        if self._shown is None or len(samples) == self._count:
            self._shown = sum(samples) / len(samples)
            if len(samples) == self._count:
                samples.clear()
        return self._shown
