"""The size that each experiment wants of an effect: one if its law is the machine's.

A law of another form fits as another size where the machine moves otherwise. How far sizes are
apart beyond their own uncertainty tells how far one that is measured elsewhere may be.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc

from hil_emulator.identify.measured.experiment import Array, Single

FEWEST = 3
"""Experiments that tell how far sizes are apart: of two, no one knows which is odd."""

BLOCKS = 20
"""Blocks of correlated residuals that a part has at least: so many tell the variance of its size to
a third, the root of two over their number."""


def parts_of_each(experiments: int) -> int:
    """Return into how many parts each of so few experiments is divided that sizes can be apart."""
    return 1 if experiments >= FEWEST else math.ceil((FEWEST + 1) / max(experiments, 1))


@dataclass
class Sizes:
    """Sizes of one effect, each with its variance.

    Attributes:
        about: size in the model.
        length: successive residuals that may be correlated.
        names: of the experiments.
        values: the size that each of them wants.
        variances: of each, serial correlation counted.

    """

    about: float
    length: int
    names: list[str] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    variances: list[float] = field(default_factory=list)

    def add(self, name: str, shown: Array | Single, left: Array, parts: int = 1) -> None:
        """Add the size that one experiment wants, or each of some equal parts if it is long enough.

        Args:
            name: of the experiment.
            shown: what the effect does there that nothing else can.
            left: residual there.
            parts: how many.

        """
        parts = min(parts, max(1, len(left) // (BLOCKS * self.length)))
        pieces = zip(np.array_split(shown, parts), np.array_split(left, parts), strict=True)
        for i, (some, rest) in enumerate(pieces):
            own = name if parts == 1 else f"{name}, part {i + 1} of {parts}"
            self._add(own, some.astype(np.float64), rest)

    def _add(self, name: str, shown: Array, left: Array) -> None:
        """Add one size, if there is any."""
        power = float(shown @ shown)
        if power <= 0.0:
            return
        step = -float(shown @ left) / power
        products = shown * (left + step * shown)
        sums = np.add.reduceat(products, np.arange(0, len(products), self.length))
        # one of them is taken by the size itself
        fewer = len(sums) / max(len(sums) - 1, 1)
        widened = max(1.0, fewer * float(sums @ sums) / power)
        self.names.append(name)
        self.values.append(self.about + step)
        self.variances.append(widened / power)

    @property
    def comparable(self) -> bool:
        """Whether enough experiments know their size at all, to less than that in the model.

        What something else in the model can do as well, as a spring's rest what a weight does,
        leaves a remainder of which none knows anything.
        """
        return sum(variance < self.about**2 for variance in self.variances) >= FEWEST

    @property
    def by_chance(self) -> float:
        """Probability that sizes of one law are as far apart (Cochran 1954, Biometrics 10, 101)."""
        degrees = len(self.values) - 1
        return float(chdtrc(degrees, self._apart)) if self.comparable else 1.0

    @property
    def spread(self) -> float:
        """Standard deviation of the sizes beyond their own uncertainty, 0 if they are no farther.

        By the method of moments, in which an experiment that hardly tells a size hardly counts
        (DerSimonian and Laird 1986, Controlled Clinical Trials 7, 177-188).
        """
        if not self.comparable:
            return 0.0
        weights = 1.0 / np.array(self.variances)
        beyond = self._apart - (len(self.values) - 1)
        total = float(np.sum(weights))
        return float(np.sqrt(max(beyond, 0.0) / (total - float(weights @ weights) / total)))

    @property
    def _apart(self) -> float:
        """Sum of the squares by which they are off their mean, each over its variance."""
        values, weights = np.array(self.values), 1.0 / np.array(self.variances)
        mean = float(weights @ values) / float(np.sum(weights))
        return float(weights @ (values - mean) ** 2)

    @property
    def elsewhere(self) -> float:
        """Standard deviation of the size in one more experiment about the mean of these."""
        return self.spread * float(np.sqrt(1.0 + 1.0 / max(len(self.values), 1)))
