"""Step sizes of the finite differences of the residual."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

DIFFERENCE = 0.05
"""Step of a derivative by an ordinary parameter, in prior standard deviations."""

FINITE = 0.3
"""Step of a derivative by an effect, in typical sizes: finite, since dead bands, hysteresis and
stops have no derivative at zero."""

LARGEST_CHANGE = 2.0
"""Norm of the residual's change that is enough for a finite difference."""

TOO_FAR = 10.0
"""Factor by which a first step may exceed that: the residual then stays in the quadratic range of
Huber's loss. A difference quotient across its linear range would be biased by noise."""


@dataclass(frozen=True)
class Derivative:
    """Partial derivative of the residual.

    Attributes:
        coordinates: that are free.
        at: their values.
        by: index of the coordinate of the derivative.

    """

    coordinates: Sequence[Coordinate]
    at: Array
    by: int

    @property
    def coordinate(self) -> Coordinate:
        """The coordinate of the derivative."""
        return self.coordinates[self.by]

    def moved(self, step: float) -> Array:
        """Return the point with that coordinate changed by a step."""
        moved = np.array(self.at, dtype=np.float64)
        moved[self.by] += step
        return moved


class Steps:
    """Chooses step sizes from the sensitivities of earlier derivatives."""

    def __init__(self) -> None:
        self._sensitivity: dict[str, float] = {}

    def learned(self, coordinates: Sequence[Coordinate]) -> bool:
        """Return whether there are earlier derivatives by all coordinates."""
        return all(c.name in self._sensitivity for c in coordinates)

    def of(self, wanted: Derivative) -> float:
        """Return the step of a derivative; 0 if the bounds of the coordinate coincide."""
        coordinate, at = wanted.coordinate, float(wanted.at[wanted.by])
        low, high = coordinate.bounds
        size = DIFFERENCE if np.isfinite(coordinate.prior) else FINITE
        least = coordinate.least / coordinate.scale
        if at < least:
            size = max(size, 1.5 * least)
        if coordinate.inverse:
            size = 1.0
        elif not np.isfinite(coordinate.prior) and at != 0.0:
            size = max(0.05 * abs(at), 0.01)
        # at an end of its range a law may be discontinuous; a shorter step would not help
        if low < at < high and (at != 0.0 or np.isfinite(coordinate.prior)):
            # the sensitivity may change over a step far larger than the uncertainty
            size = min(size, LARGEST_CHANGE / self._sensitivity.get(coordinate.name, 1e-9))
        return min(size, high - at) if high - at > at - low else -min(size, at - low)

    def again(self, wanted: Derivative, step: float) -> float:
        """Return a shorter step if the residual changed far too much; else 0."""
        shorter = self.of(wanted)
        return shorter if abs(shorter) * TOO_FAR < abs(step) else 0.0

    def learn(self, wanted: Derivative, sensitivity: Array) -> None:
        """Store the norm of a derivative for later steps."""
        self._sensitivity[wanted.coordinate.name] = max(float(np.linalg.norm(sensitivity)), 1e-9)
