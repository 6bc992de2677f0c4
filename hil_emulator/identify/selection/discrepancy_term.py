"""Nonparametric terms: what an effect in no catalogue would look like, and where.

A term is one balance and one regressor; six hat functions of the regressor are put into the balance
along the filtered trajectory. A term that explains much more than the best catalogued effect says
that the law is another one, or that the effect is unknown.
"""

from dataclasses import dataclass, field

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.balances import Balance

HATS = 6
"""Hat functions of a term."""

FINE = 24
"""The same over the place along the stroke: a tight spot is as long as a seal."""


@dataclass(frozen=True)
class DiscrepancyTerm:
    """A term that a balance may lack, over one regressor, and what it explains.

    Attributes:
        balance: where the term sits.
        regressor: what it depends on.
        statistic: gain in chi-square.
        limit: what chance reaches in one of ten thousand, residuals serially correlated.
        knots: values of the regressor.
        curve: the term there, in the balance's unit.
        columns: derivative of the residual by each hat; none of a term that is not significant, but
            for the best of those that are no error of a sensor.
        uncertainty: standard deviation that each free parameter gets from a term of this strength
            and unknown shape.
        usual: what chance reaches on average.

    """

    balance: Balance
    regressor: str
    statistic: float
    limit: float
    knots: Array
    curve: Array
    columns: Array
    uncertainty: Array = field(default_factory=lambda: np.zeros(0))
    usual: float = 0.0

    @property
    def title(self) -> str:
        """The balance and its regressor in words."""
        return f"{self.balance.name} over {self.regressor}"

    @property
    def significant(self) -> bool:
        """Whether chance hardly explains it."""
        return self.statistic > self.limit

    @property
    def surplus(self) -> float:
        """Gain in chi-square beyond what the term has by chance on average."""
        return self.statistic - self.usual

    @property
    def certain(self) -> float:
        """Gain in chi-square beyond what chance hardly ever reaches."""
        return self.statistic - self.limit
