"""How strong a fault is at a moment: its ramp, and the chance it takes."""

from collections.abc import Callable
from random import Random
from typing import NamedTuple

Change = Callable[[float, float], float]
"""Returns a value of the plant or its current from the sound one and the strength drawn."""


class Strength(NamedTuple):
    """A fault at a moment.

    Attributes:
        now_ns: emulator time [ns].
        elapsed_ns: time since it began [ns].
        ramp: how far it has grown, 0 to 1.
        random: source of chances.
        probability: of its acting.

    """

    now_ns: int
    elapsed_ns: int
    ramp: float
    random: Random
    probability: float

    def drawn(self) -> float:
        """Take the chance: return the ramp, or 0 where the fault does not act this time."""
        if self.probability < 1.0 and self.random.random() >= self.probability:
            return 0.0
        return self.ramp

    def hits(self) -> bool:
        """Take the chance for a frame; the ramp lowers the probability."""
        chance = self.probability * self.ramp
        return chance >= 1.0 or self.random.random() < chance
