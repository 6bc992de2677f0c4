"""Steps of the difference quotients by which the residual is derived."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

DIFFERENCE = 0.05
"""Step of a derivative by an ordinary parameter, in prior standard deviations."""

FINITE = 0.3
"""Step of a derivative by an effect, in typical sizes: finite on purpose, since dead bands,
hysteresis and stops have no derivative at zero."""

LARGEST_CHANGE = 2.0
"""Norm of the residual's change that a step of a derivative need not exceed."""

TOO_FAR = 10.0
"""How many times as far a first step may go: a residual that is spread over some thousand samples
then stays where Huber's loss is a square. Beyond, a difference quotient holds the noise, which the
loss tames at one of its ends only."""


@dataclass(frozen=True)
class Derivative:
    """A derivative of the residual that is wanted.

    Attributes:
        coordinates: what is free.
        at: where it is taken.
        by: index of the coordinate by which.

    """

    coordinates: Sequence[Coordinate]
    at: Array
    by: int

    @property
    def coordinate(self) -> Coordinate:
        """The coordinate by which it is taken."""
        return self.coordinates[self.by]

    def moved(self, step: float) -> Array:
        """Return the point with that coordinate a step away."""
        moved = np.array(self.at, dtype=np.float64)
        moved[self.by] += step
        return moved


class Steps:
    """Chooses steps, and learns how far the residual moves with each coordinate."""

    def __init__(self) -> None:
        self._sensitivity: dict[str, float] = {}

    def of(self, wanted: Derivative) -> float:
        """Return the step of a derivative, or 0 where the coordinate cannot move."""
        coordinate, at = wanted.coordinate, float(wanted.at[wanted.by])
        low, high = coordinate.bounds
        size = DIFFERENCE if np.isfinite(coordinate.prior) else FINITE
        if coordinate.inverse:
            size = 1.0
        elif not np.isfinite(coordinate.prior) and at != 0.0:
            size = max(0.05 * abs(at), 0.01)
        # at an end of its range a law may begin with a jump, however short the step
        if low < at < high and (at != 0.0 or np.isfinite(coordinate.prior)):
            # far beyond its own uncertainty a parameter has another sensitivity
            size = min(size, LARGEST_CHANGE / self._sensitivity.get(coordinate.name, 1e-9))
        return min(size, high - at) if high - at > at - low else -min(size, at - low)

    def again(self, wanted: Derivative, step: float) -> float:
        """Return a step to take instead of one that went far too far; 0 where it did not."""
        shorter = self.of(wanted)
        return shorter if abs(shorter) * TOO_FAR < abs(step) else 0.0

    def learn(self, wanted: Derivative, sensitivity: Array) -> None:
        """Remember how large a derivative has come out."""
        self._sensitivity[wanted.coordinate.name] = max(float(np.linalg.norm(sensitivity)), 1e-9)
