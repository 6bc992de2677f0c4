"""A fit: parameters that were fitted together, and what is known of them."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.parallel.pool import Batch
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

TOLERATED = 2.0
"""Prior standard deviations within which an ordinary parameter is believed: 95 % of machines have
it there, as of any normal distribution."""

LEAST_INFORMATION = 1e-13
"""Part of the best known direction's information below which rounding decides: 16 digits hold the
sum of a thousand products to that."""

_BLOCK = 1 << 16  # rows that are added up at once


@dataclass
class Fit:
    """Parameters that were fitted together.

    Attributes:
        coordinates: what was free.
        at: their coordinates.
        residual: weighted innovations of the training data, flat.
        jacobian: its derivative, shape (residuals, coordinates).
        chi2: sum of squares, priors included.
        effective: number of independent values among the residuals; None for all of them.
        converged: whether no step by this Jacobian leads further.
        further: covariance of the coordinates beyond that of noise; None for none.
        frozen: where the gains were computed that it was made with; None if unknown.
        deviance: there, see `Fitter.deviance`.

    """

    coordinates: list[Coordinate]
    at: Array
    residual: Array
    jacobian: Array
    chi2: float
    effective: float | None = None
    converged: bool = False
    further: Array | None = None
    frozen: Array | None = None
    deviance: float = math.nan

    @property
    def sample_size(self) -> float:
        """Number of independent values."""
        return float(len(self.residual)) if self.effective is None else self.effective

    def without(self, names: Collection[str]) -> "Fit":
        """Return the fit without some coordinates, everything else as it is."""
        kept = [i for i, c in enumerate(self.coordinates) if c.name not in names]
        free = [self.coordinates[i] for i in kept]
        further = None if self.further is None else self.further[np.ix_(kept, kept)]
        return replace(
            self, coordinates=free, at=self.at[kept], jacobian=self.jacobian[:, kept],
            further=further, frozen=None, deviance=math.nan,
        )  # fmt: skip

    def lean(self) -> "Fit":
        """Return the fit with half the memory: Jacobians of several of a long recording are large.

        A further fit may begin with such a one: it corrects it on the way.
        """
        return replace(self, jacobian=self.jacobian.astype(np.float32))

    def covariance(self) -> Array:
        """Return the covariance of the coordinates, priors included.

        What data and priors hardly tell takes no part, so that rounding makes no variance negative.
        """
        information = np.diag(prior_rows(self.coordinates) ** 2)
        for first in range(0, len(self.jacobian), _BLOCK):  # of a lean fit's, exact all the same
            block = self.jacobian[first : first + _BLOCK].astype(np.float64)
            information += block.T @ block
        told = np.diag(information)
        scale = 1.0 / np.sqrt(np.where(told > 0.0, told, 1.0))
        values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
        kept = values > LEAST_INFORMATION * values[-1] if len(values) else values > 0.0
        root = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
        known = root @ root.T
        return np.asarray(known if self.further is None else known + self.further)


@dataclass(frozen=True)
class Linearised:
    """Experiments as a fit sees them.

    Attributes:
        batch: the experiments, frozen.
        residual: weighted innovations at the fit, flat.
        jacobian: its derivative, shape (residuals, coordinates).

    """

    batch: Batch
    residual: Array
    jacobian: Array


def prior_rows(coordinates: Sequence[Coordinate]) -> Array:
    """Return one over the prior's standard deviation of each coordinate."""
    return np.array([1.0 / c.prior if np.isfinite(c.prior) else 0.0 for c in coordinates])
