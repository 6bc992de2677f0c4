"""Log evidence (marginal likelihood) of a linearised model with additional free terms.

With residual r, derivatives J by the coordinates and X by the hats of the terms, coordinates theta
with prior rows W (MacKay 1992, Neural Computation 4, 415-447),

    residual = r + J d + X'm,   theta + d ~ N(0, 1/W^2),   m ~ N(0, LL')
    S = J'J/k + W^2,   v = J'r/k + W^2 theta
    G = XX'/k - XJ S^-1 J'X'/k^2,   g = Xr/k - XJ S^-1 v/k
    log Z = q'M^-1 q/2 - log|M|/2 + constant,   M = I + L'GL,   q = L'g

Serial correlation of the residuals increases variances by k. Held-out data contribute the log
density for the most likely terms, maximised over the coordinates within their uncertainty after the
training: with their residual h, derivatives H and hats Y,

    - least over e of |h + H (d + e) + Y'm|^2/2k + e'Se/2
"""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, prior_rows
from hil_emulator.identify.estimation.shape_sums import Sums, inverse
from hil_emulator.identify.measured.experiment import Array, Index


class LogEvidence:
    """Log evidence of a model with additional terms.

    Args:
        fit: of the model.
        training: sums over the training data.
        held_out: sums over the validation data.
        inflation: factor on variances by serial correlation.

    """

    def __init__(self, fit: Fit, training: Sums, held_out: Sums, inflation: float) -> None:
        self._held, self._k = held_out, inflation
        weights = prior_rows(fit.coordinates)
        self._inverse = inverse(training.normal / inflation + np.diag(weights**2))
        slope = training.slope / inflation + weights**2 * fit.at
        self._step = -self._inverse @ slope
        self._mixed = training.mixed / inflation
        self.information = training.shapes / inflation - self._mixed @ self._inverse @ self._mixed.T
        self._gradient = training.onto / inflation + self._mixed @ self._step
        from_training = training.normal + inflation * np.diag(weights**2)
        self._posterior = inverse(held_out.normal + from_training)

    def __call__(self, rows: Array | Index, root: Array) -> tuple[float, float]:
        """Return the gain in fit and the Occam factor of some terms, in nats.

        Their sum is the log evidence, up to a constant.

        Args:
            rows: indices of the terms' hats.
            root: Cholesky factor of their prior covariance.

        """
        gradient = root.T @ self._gradient[rows]
        middle = np.eye(len(rows)) + root.T @ self.information[np.ix_(rows, rows)] @ root
        solved = np.linalg.solve(middle, gradient)
        held = 0.5 * self._held_out_chi2(rows, -root @ solved) / self._k
        return 0.5 * float(gradient @ solved) - held, -0.5 * float(np.linalg.slogdet(middle)[1])

    def terms(self, root: Array) -> tuple[Array, Array]:
        """Return the posterior mean and covariance of all terms.

        Args:
            root: Cholesky factor of their prior covariance.

        """
        middle = np.eye(len(root)) + root.T @ self.information @ root
        covariance = root @ np.linalg.solve(middle, root.T)
        return -covariance @ self._gradient, covariance

    def shift(self, terms: Array) -> Array:
        """Return the change of the coordinates' estimates with given terms."""
        return np.asarray(self._step - self._inverse @ (self._mixed.T @ terms))

    def covariance(self, terms: Array | None = None) -> Array:
        """Return the covariance of the coordinates.

        Args:
            terms: posterior covariance of the terms; None for a model without terms.

        """
        if terms is None:
            return self._inverse
        across = self._mixed @ self._inverse
        return np.asarray(self._inverse + across.T @ terms @ across)

    def _held_out_chi2(self, rows: Array | Index, terms: Array) -> float:
        """Return the sum of squared held-out residuals with the most likely terms.

        The coordinates are refitted to the held-out data within their uncertainty, so that a
        coordinate that only these data determine does not count for or against the terms.
        """
        held = self._held
        step = self._step - self._inverse @ (self._mixed[rows].T @ terms)
        chi2 = held.power + 2.0 * step @ held.slope + step @ held.normal @ step
        chi2 += 2.0 * terms @ (held.onto[rows] + held.mixed[rows] @ step)
        chi2 += terms @ held.shapes[np.ix_(rows, rows)] @ terms
        slope = held.slope + held.normal @ step + held.mixed[rows].T @ terms
        return float(chi2 - slope @ self._posterior @ slope)
