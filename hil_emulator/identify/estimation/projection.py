"""What is left of a derivative when the free parameters have done what they can."""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, prior_rows
from hil_emulator.identify.measured.experiment import Array, Single


class Projection:
    """Takes out of a column what the free parameters, within their priors, can explain."""

    def __init__(self, fit: Fit) -> None:
        self._weights = prior_rows(fit.coordinates)
        self._jacobian = fit.jacobian
        self.estimated = fit.effective is not None
        normal = fit.jacobian.T @ fit.jacobian + np.diag(self._weights**2)
        self._scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-12))
        scaled = normal * np.outer(self._scale, self._scale)
        self._inverse = np.linalg.pinv(scaled, rcond=1e-10, hermitian=True)
        self.residual = np.concatenate([fit.residual, self._weights * fit.at])

    def response(self, column: Array | Single) -> Array:
        """Return what the free parameters do to compensate a unit of the column, or of several."""
        scale = self._scale.reshape(-1, *[1] * (column.ndim - 1))
        return np.asarray(-scale * (self._inverse @ (scale * (self._jacobian.T @ column))))

    def together(self, columns: Array | Single) -> tuple[Array, Array]:
        """Return several projected columns side by side, and the response to each."""
        rows, moved = len(columns), self.response(columns)
        projected = np.empty((len(self.residual), columns.shape[1]))
        np.matmul(self._jacobian, moved, out=projected[:rows])
        projected[:rows] += columns
        projected[rows:] = self._weights[:, None] * moved
        return projected, moved

    def __call__(self, column: Array, response: Array | None = None) -> Array:
        """Return the projected column, with its part in the prior rows at the end."""
        moved = self.response(column) if response is None else response
        return np.concatenate([column + self._jacobian @ moved, self._weights * moved])
