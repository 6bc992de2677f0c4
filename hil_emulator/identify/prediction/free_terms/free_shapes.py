"""Free shapes: terms of any form, as hat functions of one regressor in one balance.

The hat functions are evaluated along the predicted trajectory.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.free_terms.balances import PISTON, TERMS, Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors

HATS = 6
"""Number of hat functions of a shape."""

FINE = 24
"""Number of hat functions along the stroke, where a tight spot may be as short as a seal."""


@dataclass(frozen=True)
class FreeShape:
    """A term of any shape.

    Attributes:
        balance: to which it is added.
        regressor: of which it is a function.
        knots: values of the regressor at the maxima of the hats.

    """

    balance: Balance
    regressor: str
    knots: Array

    @property
    def title(self) -> str:
        """The balance and its regressor in words."""
        return f"{self.balance.name} over {self.regressor}"

    @property
    def ripples(self) -> bool:
        """Whether it is friction along the stroke, where ripple is usual."""
        return along_the_stroke(self.balance, self.regressor)


def along_the_stroke(balance: Balance, regressor: str) -> bool:
    """Return whether a term is friction that changes along the stroke."""
    return balance is PISTON and regressor.startswith("position")


def shapes_along(
    balances: Collection[Balance], values: Sequence[Regressors]
) -> Iterator[FreeShape]:
    """Yield the shapes over all regressors that exist and vary.

    Args:
        balances: whose terms change the channels.
        values: of the regressors in each experiment.

    """
    for balance, regressor in TERMS:
        if balance not in balances or any(regressor not in v for v in values):
            continue
        fine = along_the_stroke(balance, regressor)
        along = np.concatenate([v[regressor] for v in values])
        knots = _knots(along, FINE if fine else HATS)
        if knots is not None:
            yield FreeShape(balance, regressor, knots)


def hats(values: Array, knots: Array) -> Array:
    """Return hat functions of `values` on `knots`, shape (samples, knots)."""
    clipped = np.clip(values, knots[0], knots[-1])
    return np.column_stack([np.interp(clipped, knots, row) for row in np.eye(len(knots))])


def _knots(values: Array, count: int) -> Array | None:
    """Return knots between quantiles and an even grid of a regressor; None if it is constant."""
    spread = np.quantile(values, np.linspace(0.01, 0.99, count))
    if spread[-1] - spread[0] < 1e-12:
        return None
    even = np.linspace(spread[0], spread[-1], count)
    return np.asarray(0.5 * (spread + even))
