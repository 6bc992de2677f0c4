"""Past samples of a quantity, for laws with a delay or a window."""

import math
from typing import Any

import numpy as np
from numba.extending import register_jitable

HISTORY = 128
"""Number of past samples that a law can use."""

Array = np.ndarray[Any, np.dtype[np.float64]]


@register_jitable
def remember(history: Array, newest: float) -> None:
    """Insert a sample before the earlier ones; the first sample also fills the past."""
    if math.isnan(history[0]):
        history[:] = newest
    for i in range(len(history) - 1, 0, -1):
        history[i] = history[i - 1]
    history[0] = newest


@register_jitable
def sample_of(history: Array, ticks: int) -> float:
    """Return the sample of `ticks` ticks ago, or the oldest sample kept."""
    value: float = history[min(ticks, len(history) - 1)]
    return value


@register_jitable
def past(history: Array, newest: float, age: float) -> float:
    """Store a sample and return the value `age` samples ago, linear between samples.

    Args:
        history: earlier samples, newest first, shape (HISTORY,); shifted here. NaN before the
            first sample.
        newest: present sample.
        age: at most HISTORY - 1.

    """
    remember(history, newest)
    whole = min(int(age), len(history) - 2)
    part = min(1.0, age - whole)
    value: float = history[whole] + part * (history[whole + 1] - history[whole])
    return value
