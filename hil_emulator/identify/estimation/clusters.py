"""Which residuals may be correlated: those near in time, and those at one place of the stroke.

Friction that ripples along the stroke, a scored wall or a bent rod acts alike whenever the rod
comes by, however long after: an error that a model without it makes there is made every time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment, Index, Mask

PLACES = 100
"""Parts of the way that a rod went in which an error may return (assumed; from 50 to 200 parts, the
variance beside a friction that ripples every 2 % of the way differs by less than a third, and what
is estimated beside the ripple by less than a deviation)."""


@dataclass(frozen=True)
class Clusters:
    """Groups of residuals that may be correlated, in two ways.

    Attributes:
        length: successive residuals that are near in time.
        places: number of the place at which each is, shape (residuals,), -1 where nobody knows;
            or empty.

    """

    length: int
    places: Index

    def variance_factor(self, difference: Array, residual: Array) -> float:
        """Return the factor by which correlation widens a variance, from 1.

        The sandwich of sums over each group, of both ways; what is near in both counts once
        (Cameron, Gelbach and Miller 2011, Journal of Business & Economic Statistics 29, 238-249).
        No way lessens what the other one has found.

        Args:
            difference: derivative of the residual, or between the residuals of two explanations.
            residual: of the better one.

        """
        power = float(difference @ difference)
        if power <= 0.0:
            return 1.0
        products = difference * residual
        widened = self._in_time(products)
        known, here, in_both = self._groups
        if len(here):
            some = products[known]
            widened += max(0.0, _of_groups(here, some) - _of_groups(in_both, some))
        return max(1.0, widened / power)

    def serial_factor(self, difference: Array, residual: Array) -> float:
        """Return the same by time alone."""
        power = float(difference @ difference)
        return max(1.0, self._in_time(difference * residual) / power) if power > 0.0 else 1.0

    def _in_time(self, products: Array) -> float:
        starts = np.arange(0, len(products), self.length)
        return float(np.sum(np.add.reduceat(products, starts) ** 2))

    @cached_property
    def _groups(self) -> tuple[Mask, Index, Index]:
        """Which places are known, their numbers, and those of each at one time."""
        known = self.places >= 0
        here = self.places[known]
        block = np.flatnonzero(known) // self.length
        return known, here, block * (1 + here.max(initial=0)) + here


UNCORRELATED = Clusters(1, np.zeros(0, np.int64))
"""Each residual by itself."""


def _of_groups(group: Index, products: Array) -> float:
    """Return the sum of squares of the sums over each group."""
    return float(np.sum(np.bincount(group, products) ** 2))


def places_of(experiments: Sequence[Experiment]) -> list[Index]:
    """Return where the rod is in every sample of each experiment.

    Args:
        experiments: with the rod's position, or without.

    Returns:
        Numbers of places, -1 where the position is unknown, or never changed.

    """
    positions = [e.matrix(("position",))[:, 0] for e in experiments]
    known = np.concatenate([p[np.isfinite(p)] for p in positions])
    low, way = (float(known.min()), float(np.ptp(known))) if len(known) else (0.0, 0.0)
    if way == 0.0:
        return [np.full(len(p), -1) for p in positions]
    parts = [np.minimum(np.floor((p - low) * (PLACES / way)), PLACES - 1) for p in positions]
    return [np.nan_to_num(p, nan=-1.0).astype(np.int64) for p in parts]
