"""Linear propagation of small terms in the balances to the innovations, along a trajectory."""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Single
from hil_emulator.identify.prediction.model_run.records import Entries, Gains, Jacobians
from hil_emulator.identify.prediction.model_run.small_matrices import multiply_eights

SMALLEST = 1e-16
"""Changes below this are set to zero. Their products would be subnormal in single precision, below
1.2e-38, and ten times slower."""


class Changes(NamedTuple):
    """Changes by terms in one sample, shape (..., terms), padded to a multiple of eight terms.

    Attributes:
        dz: of z.
        after: of z in the next sample.
        dy: of the readings.
        whitened: of the innovations.

    """

    dz: Array
    after: Array
    dy: Array
    whitened: Array


def propagate(
    gains: Gains, jacobians: Jacobians, entry: Entries, inputs: Array, outputs: Array,
    columns: Single,
) -> None:  # fmt: skip
    """Compute the derivatives of the residual by small terms along the base trajectory.

    Args:
        gains: frozen gains.
        jacobians: along the base trajectory.
        entry: derivatives of z and readings by a term.
        inputs: each term along the trajectory, shape (samples, terms); without rows, zero.
        outputs: direct additions to the readings, shape (samples, chosen, terms); without rows,
            zero.
        columns: receives the derivatives of the whitened innovations, shape (terms, samples,
            chosen).

    """
    n, m = gains.kalman.shape[1:]
    width = -(-len(columns) // 8) * 8
    changes = Changes(
        np.zeros((n, width)), np.zeros((n, width)), np.zeros((m, width)), np.zeros((m, width))
    )
    propagate_samples(gains, jacobians, entry, inputs, outputs, changes, columns)


def propagate_samples(
    gains: Gains, jacobians: Jacobians, entry: Entries, inputs: Array, outputs: Array,
    changes: Changes, columns: Single,
) -> None:  # fmt: skip
    """Propagate along all samples; arguments and results as for `propagate`."""
    dz, after, dy, whitened = changes
    n, m, terms = len(dz), len(dy), len(columns)
    drives, feeds = entry.drives, entry.feeds
    for k in range(columns.shape[1]):
        if len(outputs) > 0:
            for i in range(m):
                for t in range(terms):
                    dy[i, t] += outputs[k, i, t]
        multiply_eights(gains.whitening[k].T, dy, -1.0, 0.0, whitened)
        for t in range(terms):
            for i in range(m):
                change = whitened[i, t]
                columns[t, k, i] = change if abs(change) > SMALLEST else 0.0
        multiply_eights(gains.kalman[k], dy, -1.0, 1.0, dz)
        multiply_eights(jacobians.maps[k], dz, 1.0, 0.0, after)
        multiply_eights(jacobians.senses[k], dz, 1.0, 0.0, dy)
        if len(inputs) > 0:
            for i in range(n):
                for t in range(terms):
                    after[i, t] += drives[k, i] * inputs[k, t]
            for i in range(m):
                for t in range(terms):
                    dy[i, t] += feeds[k, i] * inputs[k, t]
        for i in range(n):
            for t in range(terms):
                dz[i, t] = after[i, t]
