"""The ramp of a valve's set point (CiA 408, objects 0x6330 to 0x6336).

Accelerating is moving away from zero, decelerating moving towards it. The times are those from
zero to 100 %.
"""

from enum import IntEnum

from hil_emulator.device.dictionary import Dictionary
from hil_emulator.device.profiles.record_value import FULL_SCALE, seconds

RAMP_TYPE = 0x6330
ACCELERATION = (0x6331, 0x6332, 0x6333)
"""Acceleration time: both directions, positive, negative."""
DECELERATION = (0x6334, 0x6335, 0x6336)
"""Deceleration time: both directions, positive, negative."""


class RampType(IntEnum):
    """Values of 0x6330."""

    OFF = 0
    ONE_TIME = 1
    TWO_TIMES = 2
    FOUR_TIMES = 3


class Ramp:
    """Limits how fast a set point changes.

    Args:
        dictionary: the valve's dictionary, with the ramp's parameters.

    Attributes:
        value: the ramp's output, in digits of 1/16384.

    """

    def __init__(self, dictionary: Dictionary) -> None:
        self._dictionary = dictionary
        self.value = 0.0
        self.reload()

    def reload(self) -> None:
        """Take over the parameters."""
        entry = self._dictionary.number(RAMP_TYPE)
        kind = RampType.OFF if entry is None else entry.value
        both = seconds(self._dictionary, ACCELERATION[0])
        away, towards = (both, both), (both, both)
        if kind == RampType.TWO_TIMES:
            slow = seconds(self._dictionary, DECELERATION[0])
            towards = (slow, slow)
        elif kind == RampType.FOUR_TIMES:
            away = self._pair(ACCELERATION)
            towards = self._pair(DECELERATION)
        self.on = kind != RampType.OFF
        self._away = tuple(map(_rate, away))
        self._towards = tuple(map(_rate, towards))

    def follow(self, target: float, elapsed: float) -> float:
        """Move towards a target for a time [s] and return the new value.

        A move through zero decelerates down to it and accelerates from it.
        """
        if not self.on:
            self.value = target
            return target
        left = elapsed
        if self.value and self.value * target <= 0.0:
            rate = self._towards[self.value < 0.0]
            left -= abs(self.value) / rate
            if left < 0.0:
                self.value = -left * rate * (1 if self.value > 0.0 else -1)
                return self.value
            self.value = 0.0
        away = abs(target) > abs(self.value)
        negative = (target or self.value) < 0.0
        step = (self._away if away else self._towards)[negative] * left
        change = target - self.value
        self.value = target if abs(change) <= step else self.value + (step if change > 0 else -step)
        return self.value

    def _pair(self, indices: tuple[int, int, int]) -> tuple[float, float]:
        return seconds(self._dictionary, indices[1]), seconds(self._dictionary, indices[2])


def _rate(time: float) -> float:
    """Return digits per second; a time of zero is no limit."""
    return FULL_SCALE / time if time > 0.0 else float("inf")
