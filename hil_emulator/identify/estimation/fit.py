"""Results of joint fits: estimates, residual, Jacobian and covariance."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.parallel.pool import Batch
from hil_emulator.identify.prediction.plant.coordinate import Coordinate

TOLERATED = 2.0
"""Prior standard deviations within which an ordinary parameter is plausible (95 % of machines)."""

LEAST_INFORMATION = 1e-13
"""Share of the best determined direction's information below which a direction is rounding error:
relative precision of the sum of a thousand products with 16 digits."""

_BLOCK = 1 << 16  # rows per matrix product


@dataclass
class Fit:
    """Joint fit of some coordinates.

    Attributes:
        coordinates: that were fitted.
        at: their values.
        residual: weighted innovations of the training data, flat.
        jacobian: its derivative, shape (residuals, coordinates).
        chi2: sum of squares, priors included.
        effective: number of independent values among the residuals; None for all of them.
        converged: whether no step with this Jacobian reduces chi-square.
        further: covariance of the coordinates in addition to that of noise, or None.
        frozen: values at which the filter gains were computed; None if unknown.
        deviance: at these values, see `Fitter.deviance`.

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
        """Return the fit without some coordinates, the others unchanged."""
        kept = [i for i, c in enumerate(self.coordinates) if c.name not in names]
        free = [self.coordinates[i] for i in kept]
        further = None if self.further is None else self.further[np.ix_(kept, kept)]
        return replace(
            self, coordinates=free, at=self.at[kept], jacobian=self.jacobian[:, kept],
            further=further, frozen=None, deviance=math.nan,
        )  # fmt: skip

    def lean(self) -> "Fit":
        """Return the fit with a Jacobian of single precision, to save memory.

        It is precise enough as the start of another fit, which updates it.
        """
        return replace(self, jacobian=self.jacobian.astype(np.float32))

    def covariance(self) -> Array:
        """Return the covariance of the coordinates, priors included.

        Directions without information are left out, so that no variance is negative by rounding.
        """
        information = np.diag(prior_rows(self.coordinates) ** 2)
        for first in range(0, len(self.jacobian), _BLOCK):  # in double precision for a lean fit too
            block = self.jacobian[first : first + _BLOCK].astype(np.float64)
            information += block.T @ block
        diagonal = np.diag(information)
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
        kept = values > LEAST_INFORMATION * values[-1] if len(values) else values > 0.0
        root = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
        covariance = root @ root.T
        return np.asarray(covariance if self.further is None else covariance + self.further)


@dataclass(frozen=True)
class Linearised:
    """Experiments linearised at a fit.

    Attributes:
        batch: the experiments, frozen.
        residual: weighted innovations at the fit, flat.
        jacobian: its derivative, shape (residuals, coordinates).

    """

    batch: Batch
    residual: Array
    jacobian: Array


def prior_rows(coordinates: Sequence[Coordinate]) -> Array:
    """Return the inverse prior standard deviation of each coordinate; 0 without a prior."""
    return np.array([1.0 / c.prior if np.isfinite(c.prior) else 0.0 for c in coordinates])
