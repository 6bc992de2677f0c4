"""Two-way clusters of residuals that may be correlated: by time, and by place of the stroke.

Friction ripple, a scored cylinder wall or a bent rod cause the same model error whenever the rod
passes the place.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment, Index, Mask

PLACES = 100
"""Number of places along the travelled stroke (assumed). Between 50 and 200 places, for friction
ripple with a period of 2 % of the stroke, variances change by less than a third and estimates by
less than one standard deviation."""


@dataclass(frozen=True)
class Clusters:
    """Groups of residuals that may be correlated, by time and by place.

    Attributes:
        length: number of successive residuals in a group by time.
        places: index of the place of each residual, shape (residuals,), -1 if unknown; or empty.

    """

    length: int
    places: Index

    def variance_factor(self, difference: Array, residual: Array) -> float:
        """Return the factor, at least 1, by which correlation increases a variance.

        Two-way cluster-robust (sandwich) variance over that of independent residuals (Cameron,
        Gelbach and Miller 2011, Journal of Business & Economic Statistics 29, 238-249). The
        contribution of the places is not allowed to be negative.

        Args:
            difference: derivative of the residual, or difference of two models' residuals.
            residual: of the better model.

        """
        power = float(difference @ difference)
        if power <= 0.0:
            return 1.0
        products = difference * residual
        widened = self._in_time(products)
        placed, place, place_and_time = self._groups
        if len(place):
            some = products[placed]
            widened += max(0.0, _of_groups(place, some) - _of_groups(place_and_time, some))
        return max(1.0, widened / power)

    def serial_factor(self, difference: Array, residual: Array) -> float:
        """Return the same factor with groups by time only."""
        power = float(difference @ difference)
        return max(1.0, self._in_time(difference * residual) / power) if power > 0.0 else 1.0

    def _in_time(self, products: Array) -> float:
        starts = np.arange(0, len(products), self.length)
        return float(np.sum(np.add.reduceat(products, starts) ** 2))

    @cached_property
    def _groups(self) -> tuple[Mask, Index, Index]:
        """Mask of residuals with a place, their groups by place, and by place and time."""
        placed = self.places >= 0
        place = self.places[placed]
        block = np.flatnonzero(placed) // self.length
        return placed, place, block * (1 + place.max(initial=0)) + place


UNCORRELATED = Clusters(1, np.zeros(0, np.int64))
"""Every residual is a group of its own."""


def _of_groups(group: Index, products: Array) -> float:
    """Return the sum of squares of the sums over each group."""
    return float(np.sum(np.bincount(group, products) ** 2))


def places_of(experiments: Sequence[Experiment]) -> list[Index]:
    """Return the place of the rod in every sample of each experiment.

    Args:
        experiments: with or without the rod's position.

    Returns:
        Indices of places; -1 if the position is unknown or constant.

    """
    positions = [e.matrix(("position",))[:, 0] for e in experiments]
    finite = np.concatenate([p[np.isfinite(p)] for p in positions])
    low, stroke = (float(finite.min()), float(np.ptp(finite))) if len(finite) else (0.0, 0.0)
    if stroke == 0.0:
        return [np.full(len(p), -1) for p in positions]
    parts = [np.minimum(np.floor((p - low) * (PLACES / stroke)), PLACES - 1) for p in positions]
    return [np.nan_to_num(p, nan=-1.0).astype(np.int64) for p in parts]
