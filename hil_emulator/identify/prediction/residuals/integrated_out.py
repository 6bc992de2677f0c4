"""Differences that are integrated out of residuals.

Differences with columns X of the whitened residual, each scaled by its standard deviation, turn the
residual's covariance I into I + X X'. Residuals and derivatives are multiplied by its inverse root,
(I + X X')^(-1/2) = I - U diag(1 - 1/sqrt(1 + s²)) U' with X = U diag(s) V'.
"""

from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Single

NEGLIGIBLE = 1e-6
"""Square of a singular value below which a difference changes nothing."""


@dataclass(frozen=True)
class IntegratedOut:
    """What differences do to a residual.

    Attributes:
        directions: orthonormal, shape (residuals, directions).
        removed: share of the part along each direction that is removed.

    """

    directions: Array
    removed: Array

    def of(self, rows: Array | Single) -> Array:
        """Return rows, shape (..., residuals), with the differences integrated out."""
        return np.asarray(rows - ((rows @ self.directions) * self.removed) @ self.directions.T)


def integrated_out(columns: Array) -> IntegratedOut:
    """Return what columns, shape (columns, residuals), do."""
    x = np.where(np.isfinite(columns), columns, 0.0).astype(np.float64)
    powers, vectors = np.linalg.eigh(x @ x.T)
    kept = powers > NEGLIGIBLE
    directions = (x.T @ vectors[:, kept]) / np.sqrt(powers[kept])
    return IntegratedOut(directions, 1.0 - 1.0 / np.sqrt(1.0 + powers[kept]))
