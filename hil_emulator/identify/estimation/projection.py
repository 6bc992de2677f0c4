"""Projection of derivatives orthogonal to those of the free parameters, with their priors."""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, prior_rows
from hil_emulator.identify.measured.experiment import Array, Single


class Projection:
    """Removes from a column what the free parameters, within their priors, explain.

    Attributes:
        estimated: whether the noise is estimated from the residual.
        residual: of the fit, with the prior rows appended.

    """

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
        """Return the change of the free parameters that compensates one unit of each column."""
        scale = self._scale.reshape(-1, *[1] * (column.ndim - 1))
        return np.asarray(-scale * (self._inverse @ (scale * (self._jacobian.T @ column))))

    def together(self, columns: Array | Single) -> tuple[Array, Array]:
        """Return several projected columns, and the response to each."""
        rows, response = len(columns), self.response(columns)
        projected = np.empty((len(self.residual), columns.shape[1]))
        np.matmul(self._jacobian, response, out=projected[:rows])
        projected[:rows] += columns
        projected[rows:] = self._weights[:, None] * response
        return projected, response

    def __call__(self, column: Array, response: Array | None = None) -> Array:
        """Return the projected column with the prior rows appended."""
        change = self.response(column) if response is None else response
        return np.concatenate([column + self._jacobian @ change, self._weights * change])
