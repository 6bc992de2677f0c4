"""How strong a fault is at a moment: its ramp, and the chance it takes."""

from random import Random
from typing import NamedTuple

from hil_emulator.faults.fault import Fault


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


def strength(fault: Fault, random: Random, began_ns: int, now_ns: int) -> Strength:
    """Return how strong a fault is that began at `began_ns`."""
    elapsed = now_ns - began_ns
    ramp = min(1.0, elapsed / fault.ramp_ns) if fault.ramp_ns else 1.0
    return Strength(now_ns, elapsed, ramp, random, fault.probability)
