"""How probable data are, given terms of any shape beside a model, all else integrated out.

With residual r, derivatives J by the coordinates and X by the hats of the terms, coordinates theta
with prior rows W (MacKay 1992, Neural Computation 4, 415-447, in the linearised model),

    residual = r + J d + X'm,   theta + d ~ N(0, 1/W^2),   m ~ N(0, LL')
    S = J'J/k + W^2,   v = J'r/k + W^2 theta
    G = XX'/k - XJ S^-1 J'X'/k^2,   g = Xr/k - XJ S^-1 v/k
    log Z = q'M^-1 q/2 - log|M|/2 + what is the same for all,   M = I + L'GL,   q = L'g

Serial correlation of the residuals widens variances by k. Of held-out data counts the logarithm of
the density that the most likely terms give them, wherever the training data leave the coordinates
open: with their residual h, derivatives H and hats Y,

    - least over e of |h + H (d + e) + Y'm|^2/2k + e'Se/2
"""

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, prior_rows
from hil_emulator.identify.estimation.shape_sums import Sums, inverse
from hil_emulator.identify.measured.experiment import Array, Index


class LogEvidence:
    """Log evidence of a model with terms beside it.

    Args:
        fit: the model.
        training: of the data that it was fitted to.
        held_out: of others.
        inflation: of variances by serial correlation.

    """

    def __init__(self, fit: Fit, training: Sums, held_out: Sums, inflation: float) -> None:
        self._held, self._k = held_out, inflation
        weights = prior_rows(fit.coordinates)
        self._inverse = inverse(training.normal / inflation + np.diag(weights**2))
        slope = training.slope / inflation + weights**2 * fit.at
        self._moved = -self._inverse @ slope
        self._mixed = training.mixed / inflation
        self.information = training.shapes / inflation - self._mixed @ self._inverse @ self._mixed.T
        self._gradient = training.onto / inflation + self._mixed @ self._moved
        known = training.normal + inflation * np.diag(weights**2)
        self._open = inverse(held_out.normal + known)

    def __call__(self, rows: Array | Index, root: Array) -> tuple[float, float]:
        """Return what the data say for some terms, and for their freedom, in nats.

        The sum is the log evidence, up to what is the same for all terms.

        Args:
            rows: of the terms' hats.
            root: of their prior covariance, a triangle.

        """
        pull = root.T @ self._gradient[rows]
        middle = np.eye(len(rows)) + root.T @ self.information[np.ix_(rows, rows)] @ root
        solved = np.linalg.solve(middle, pull)
        held = 0.5 * self._predicted(rows, -root @ solved) / self._k
        return 0.5 * float(pull @ solved) - held, -0.5 * float(np.linalg.slogdet(middle)[1])

    def terms(self, root: Array) -> tuple[Array, Array]:
        """Return what all terms are expected to be, and their covariance.

        Args:
            root: of their prior covariance, a triangle.

        """
        middle = np.eye(len(root)) + root.T @ self.information @ root
        covariance = root @ np.linalg.solve(middle, root.T)
        return -covariance @ self._gradient, covariance

    def shift(self, terms: Array) -> Array:
        """Return how far the coordinates move beside terms."""
        return np.asarray(self._moved - self._inverse @ (self._mixed.T @ terms))

    def covariance(self, terms: Array | None = None) -> Array:
        """Return the covariance of the coordinates beside terms of a covariance, or of none."""
        if terms is None:
            return self._inverse
        across = self._mixed @ self._inverse
        return np.asarray(self._inverse + across.T @ terms @ across)

    def _predicted(self, rows: Array | Index, terms: Array) -> float:
        """Return the sum of squares that the most likely terms leave of held-out data.

        What the coordinates may do there as well is no merit of the terms: a chamber that empties
        in one experiment tells of the air in the oil what no other does.
        """
        held = self._held
        moved = self._moved - self._inverse @ (self._mixed[rows].T @ terms)
        left = held.power + 2.0 * moved @ held.slope + moved @ held.normal @ moved
        left += 2.0 * terms @ (held.onto[rows] + held.mixed[rows] @ moved)
        left += terms @ held.shapes[np.ix_(rows, rows)] @ terms
        slope = held.slope + held.normal @ moved + held.mixed[rows].T @ terms
        return float(left - slope @ self._open @ slope)
