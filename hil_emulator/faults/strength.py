"""Strength of a fault at a time: its ramp and its probability."""

from collections.abc import Callable
from random import Random
from typing import NamedTuple

Change = Callable[[float, float], float]
"""Returns a value of the plant or its current from the healthy value and the drawn strength."""


class Strength(NamedTuple):
    """A fault at a time.

    Attributes:
        now_ns: emulator time [ns].
        elapsed_ns: time since it began [ns].
        ramp: how far it has grown, 0 to 1.
        random: generator of random numbers.
        probability: of its acting.

    """

    now_ns: int
    elapsed_ns: int
    ramp: float
    random: Random
    probability: float

    def drawn(self) -> float:
        """Draw the strength: the ramp, or 0 if the fault does not act this time."""
        if self.probability < 1.0 and self.random.random() >= self.probability:
            return 0.0
        return self.ramp

    def hits(self) -> bool:
        """Draw whether the fault acts on a frame; the ramp lowers the probability."""
        chance = self.probability * self.ramp
        return chance >= 1.0 or self.random.random() < chance
