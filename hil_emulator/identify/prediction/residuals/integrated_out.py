"""Random model differences that are integrated out of residuals.

With columns X of the whitened residual, each scaled by its prior standard deviation, differences
change the residual's covariance from I to I + X X'. Residuals and derivatives are multiplied by its
inverse root:
with X'X = V diag(s²) V', (I + X X')^(-1/2) = I - X V diag((1 - 1/sqrt(1 + s²))/s²) V' X'.
"""

from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Single

NEGLIGIBLE = 1e-6
"""Square of a singular value below which a difference is negligible."""


@dataclass(frozen=True)
class IntegratedOut:
    """Projection that integrates differences out of a residual.

    Attributes:
        columns: X' of all differences, shape (differences, residuals).
        removal: matrix between X and X', shape (differences, differences).
        log_determinant: logarithm of the determinant of I + X X'.
        laws: law of each difference, in words.

    """

    columns: Array
    removal: Array
    log_determinant: float
    laws: tuple[str, ...] = ()

    def of(self, rows: Array | Single) -> Array:
        """Return rows, shape (..., residuals), with the differences integrated out."""
        return np.asarray(rows - ((rows @ self.columns.T) @ self.removal) @ self.columns)

    def within(self, first: int, last: int) -> "IntegratedOut":
        """Return the projection of some of the residuals, with independent differences."""
        return integrated_out(np.ascontiguousarray(self.columns[:, first:last]), self.laws)


def integrated_out(columns: Array, laws: tuple[str, ...] = ()) -> IntegratedOut:
    """Return the projection for the finite ones of some columns, shape (differences, residuals)."""
    x = np.where(np.isfinite(columns).all(axis=1, keepdims=True), columns, 0.0)
    powers, vectors = np.linalg.eigh(x @ x.T)
    powers = np.maximum(powers, NEGLIGIBLE)
    kept = (1.0 - 1.0 / np.sqrt(1.0 + powers)) / powers
    grown = float(np.log1p(powers).sum())
    return IntegratedOut(x, (vectors * kept) @ vectors.T, grown, laws)
