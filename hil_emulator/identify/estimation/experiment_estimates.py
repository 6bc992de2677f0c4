"""Estimates of one coordinate from single experiments, and their heterogeneity.

If a law is wrong, the estimates of its parameters depend on the motion. Their spread beyond their
own uncertainty is therefore the uncertainty of the value for another motion.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc

from hil_emulator.identify.measured.experiment import Array, Single

FEWEST = 3
"""Number of estimates from which a spread is computed: of two, the outlier is unknown."""

BLOCKS = 20
"""Smallest number of blocks of correlated residuals per estimate; its variance then has a relative
standard error of sqrt(2 / 20), about a third."""


def parts_per_experiment(experiments: int) -> int:
    """Return the number of parts that each experiment is divided into to have enough estimates."""
    return 1 if experiments >= FEWEST else math.ceil((FEWEST + 1) / max(experiments, 1))


@dataclass
class EstimatesByExperiment:
    """Estimates of one coordinate, each with its variance.

    Attributes:
        reported: value in the model.
        length: number of successive residuals that may be correlated.
        names: of the experiments.
        values: estimate of each experiment.
        variances: of these estimates, with serial correlation.
        prior: standard deviation of an ordinary parameter's prior; infinite for an effect.

    """

    reported: float
    length: int
    names: list[str] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    variances: list[float] = field(default_factory=list)
    prior: float = math.inf

    def add(self, name: str, column: Array | Single, residual: Array, parts: int = 1) -> None:
        """Add the estimate of an experiment, or of its equal parts if it is long enough.

        Args:
            name: of the experiment.
            column: sensitivity to the coordinate, all other coordinates projected out.
            residual: of the model.
            parts: number of parts.

        """
        parts = min(parts, max(1, len(residual) // (BLOCKS * self.length)))
        pieces = zip(np.array_split(column, parts), np.array_split(residual, parts), strict=True)
        for i, (some, rest) in enumerate(pieces):
            title = name if parts == 1 else f"{name}, part {i + 1} of {parts}"
            self._add(title, some.astype(np.float64), rest)

    def _add(self, name: str, column: Array, residual: Array) -> None:
        """Add one estimate, unless the experiment has no information."""
        power = float(column @ column)
        if power <= 0.0:
            return
        step = -float(column @ residual) / power
        products = column * (residual + step * column)
        sums = np.add.reduceat(products, np.arange(0, len(products), self.length))
        # the estimate takes one degree of freedom
        correction = len(sums) / max(len(sums) - 1, 1)
        widened = max(1.0, correction * float(sums @ sums) / power)
        self.names.append(name)
        self.values.append(self.reported + step)
        self.variances.append(widened / power)

    @property
    def comparable(self) -> bool:
        """Whether enough estimates are more certain than the prior, or than an effect is large.

        Otherwise the coordinate is nearly collinear with others, such as a weight with the preload
        of a spring, and the data do not determine the estimates.
        """
        largest = self.prior if math.isfinite(self.prior) else abs(self.reported)
        return sum(variance < largest**2 for variance in self.variances) >= FEWEST

    @property
    def p_value(self) -> float:
        """P-value of Cochran's test of homogeneity (Cochran 1954, Biometrics 10, 101)."""
        degrees = len(self.values) - 1
        return float(chdtrc(degrees, self._cochran_q)) if self.comparable else 1.0

    @property
    def between_experiments(self) -> float:
        """Standard deviation between experiments, in excess of the estimates' own uncertainty.

        Method of moments with inverse-variance weights (DerSimonian and Laird 1986, Controlled
        Clinical Trials 7, 177-188).
        """
        if not self.comparable:
            return 0.0
        weights = 1.0 / np.array(self.variances)
        excess = self._cochran_q - (len(self.values) - 1)
        total = float(np.sum(weights))
        return float(np.sqrt(max(excess, 0.0) / (total - float(weights @ weights) / total)))

    @property
    def _cochran_q(self) -> float:
        """Sum of the squared deviations from the weighted mean, each over its variance."""
        values, weights = np.array(self.values), 1.0 / np.array(self.variances)
        mean = float(weights @ values) / float(np.sum(weights))
        return float(weights @ (values - mean) ** 2)

    @property
    def of_mean(self) -> float:
        """Standard deviation of the mean of these experiments, by their heterogeneity alone."""
        return self.between_experiments / math.sqrt(max(len(self.values), 1))

    @property
    def of_new_experiment(self) -> float:
        """Standard deviation of the value in a further experiment about the mean of these."""
        return self.between_experiments * float(np.sqrt(1.0 + 1.0 / max(len(self.values), 1)))
