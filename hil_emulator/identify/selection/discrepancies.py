"""Bayesian comparison of the final model with models that have additional free terms.

Each term is a smooth function of one regressor in one balance, with a Gaussian process prior
(Kennedy and O'Hagan 2001). In the balance of a named effect it may be the lack of fit of its law,
which is small compared with the effect; any other term is unknown. Terms are added while they
increase the log evidence.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hil_emulator.identify.estimation.fit import Fit, Linearised, prior_rows
from hil_emulator.identify.estimation.log_evidence import LogEvidence
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.shape_sums import ShapeSums, inverse
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.free_terms.free_shapes import HATS, FreeShape
from hil_emulator.identify.prediction.free_terms.term_matching import is_part
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import LAW_TOLERANCE, NOTICEABLE

LAW_ERROR_SIZES = (0.05, 0.1, 0.2, 0.4)
"""Prior of the root mean square error of a law over that of its effect: equally probable values.

A linear law leaves 0.17 of a power law of order 4/7 (turbulent gap), 0.2 of an orifice's law, 0.25
of a square and 0.4 of a cubic one (odd curve of a sensor). Parts of such laws leave less."""

VARIANCE_SHARES = tuple(10.0 ** (0.5 * i) for i in range(-8, 2))
"""Prior of an unknown term's share of the innovations' variance: equally probable values from 1e-4,
which six hats reach by chance in data of one minute, to 3."""

SMOOTH = 1.5
"""Correlation length of a term, in hats: neighbours are correlated by 0.8, the ends of the range
are not, so that the curve bends once or twice."""

MOST_DISCREPANCIES = 4
"""Largest number of additional terms."""


@dataclass(frozen=True)
class Discrepancy:
    """A free term that increases the evidence of the model.

    Attributes:
        shape: its balance and regressor.
        owner: named effect whose law it belongs to; "" for an unknown term, None for friction
            ripple.
        nats: gain in log evidence.
        explained: this gain, converted to chi-square of the training data.

    """

    shape: FreeShape
    owner: str | None
    nats: float
    explained: float


class Contribution(NamedTuple):
    """Chi-square of the change of the residual if an effect is removed.

    Attributes:
        total: with all other coordinates fixed.
        unique: with all other coordinates refitted (linearised).

    """

    total: float
    unique: float


@dataclass(frozen=True)
class _Option:
    """Hypothesis on a term: its prior variance, its log prior probability and its owner."""

    variance: float
    log_prior: float
    owner: str | None


class Discrepancies:
    """Additional free terms of a final model.

    Args:
        fitter: with the training data, frozen at the fit.
        fit: of the final model.
        effects: named effects.
        held: validation data, or None.

    Attributes:
        contributions: of each effect, by name.
        shapes: terms that are considered.
        selected: terms that increase the evidence, the most probable first.

    """

    def __init__(
        self, fitter: Fitter, fit: Fit, effects: Sequence[Coordinate], held: Linearised | None
    ) -> None:
        self._fit, self._effects = fit, list(effects)
        sums = ShapeSums(fitter, fit)
        self.shapes, self._training = sums.shapes, sums.training()
        held_out = sums.held_out(held)
        ends = np.cumsum([0, *(len(s.knots) for s in self.shapes)])
        self._rows = [np.arange(first, end) for first, end in pairwise(ends)]
        self._roots = [_smooth(len(s.knots)) for s in self.shapes]
        inflations = sums.inflations(self._training)
        self._inflation = float(np.median(inflations)) if len(inflations) else 1.0
        self._inflations = np.maximum(inflations, self._inflation)
        self._evidence = LogEvidence(fit, self._training, held_out, self._inflation)
        self._part = self._training.rows / (self._training.rows + held_out.rows)
        self.contributions = {c.name: self._contribution(fitter, c) for c in self._effects}
        self._options = [list(self._hypotheses(i)) for i in range(len(self.shapes))]
        self.selected = self._select()

    @property
    def lack_of_fit(self) -> dict[str, float]:
        """Lack of fit of each effect's law, as a share of what the effect explains, by name."""
        return {c.name: sum(d.explained for d in self.selected if d.owner == c.name)
                / self.contributions[c.name].unique for c in self._effects}  # fmt: skip

    def other_laws(self) -> dict[str, str]:
        """Return, by effect, the reason why its law is not the catalogue's.

        Terms below the threshold `NOTICEABLE` are ignored, as for unknown terms.
        """
        reasons = {}
        for c in self._effects:
            terms = [d for d in self.selected if d.owner == c.name and self._noticeable(d)]
            part = sum(d.explained for d in terms) / self.contributions[c.name].unique
            if part > LAW_TOLERANCE:
                title = max(terms, key=lambda d: d.explained).shape.title
                reasons[c.name] = f"a free term in the {title} explains {100.0 * part:.0f} % more"
        return reasons

    def unknown(self) -> list[FreeShape]:
        """Return noticeable terms that belong to no effect, the most probable first."""
        return [d.shape for d in self.selected if not d.owner and self._noticeable(d)]

    def _noticeable(self, d: Discrepancy) -> bool:
        least = NOTICEABLE * self._fit.sample_size / HATS
        return d.explained > least * len(d.shape.knots)

    def _select(self) -> list[Discrepancy]:
        """Return the terms that increase the evidence, by forward selection."""
        rows, root = np.zeros(0, dtype=int), np.zeros((0, 0))
        rest = list(range(len(self.shapes)))
        selected: list[Discrepancy] = []
        while rest and len(selected) < MOST_DISCREPANCIES:
            before = self._evidence(rows, root)
            gains = (self._gain(rows, root, before, i) for i in rest)
            nats, i, option = max(gains, key=lambda gain: gain[0])
            if nats <= 0.0:
                break
            rest.remove(i)
            rows, root = self._extended(rows, root, i, option.variance)
            explained = 2.0 * float(self._inflations[i]) * nats * self._part
            selected.append(Discrepancy(self.shapes[i], option.owner, nats, explained))
        return selected

    def _gain(
        self, rows: Array, root: Array, before: tuple[float, float], i: int
    ) -> tuple[float, int, _Option]:  # fmt: skip
        """Return the gain in log evidence of one more term, its index and its best hypothesis.

        The information of the data is reduced by their serial correlation along the term.
        """
        reduction = self._inflation / self._inflations[i]
        nats = []
        for option in self._options[i]:
            data, occam = self._evidence(*self._extended(rows, root, i, option.variance))
            nats.append(option.log_prior + reduction * (data - before[0]) + occam - before[1])
        return float(np.logaddexp.reduce(nats)), i, self._options[i][int(np.argmax(nats))]

    def _extended(self, rows: Array, root: Array, i: int, variance: float) -> tuple[Array, Array]:
        """Return rows and prior root covariance with those of one more term."""
        added = math.sqrt(variance) * self._roots[i]
        zeros = np.zeros((len(root), len(added)))
        return np.append(rows, self._rows[i]), np.block([[root, zeros], [zeros.T, added]])

    def _hypotheses(self, i: int) -> Iterator[_Option]:
        """Yield the hypotheses on a term."""
        shape, rows = self.shapes[i], self._rows[i]
        kernel = self._roots[i] @ self._roots[i].T
        here = np.ix_(rows, rows)
        shown = self._inflation * float(np.sum(kernel * self._evidence.information[here]))
        each = self._fit.sample_size / max(shown, 1e-9)
        owners = [c for c in self._effects if is_part(shape, c)]
        if shape.ripples:
            usual = NOTICEABLE * len(rows) / HATS
            small = [s for s in VARIANCE_SHARES if s <= usual]
            yield from (_Option(s * each, -math.log(2 * len(small)), None) for s in small)
        # a large term in the balance of a named effect is the lack of fit of its law, too
        names = [c.name for c in owners] or [""]
        chance = -math.log(len(self.shapes) * len(VARIANCE_SHARES) * len(names))
        yield from (_Option(s * each, chance, name) for name in names for s in VARIANCE_SHARES)
        whole = max(float(np.sum(kernel * self._training.shapes[here])), 1e-9)
        for c in owners:
            places = sum(is_part(s, c) for s in self.shapes)
            chance = -math.log(places * len(LAW_ERROR_SIZES))
            unit = self.contributions[c.name].total / whole
            yield from (_Option(size**2 * unit, chance, c.name) for size in LAW_ERROR_SIZES)

    def _contribution(self, fitter: Fitter, c: Coordinate) -> Contribution:
        """Return the contribution of an effect, from a prediction without it.

        The tangent of a saturating law, such as a pump's, may be wrong by a factor of 10 or 100.
        """
        fit, names = self._fit, [k.name for k in self._fit.coordinates]
        rest = [i for i, name in enumerate(names) if name != c.name]
        off = np.where([name == c.name for name in names], 0.0, fit.at)
        change = fitter.residual(fit.coordinates, off) - fit.residual
        others = inverse(
            self._training.normal[np.ix_(rest, rest)]
            + np.diag(prior_rows(fit.coordinates)[rest] ** 2)
        )
        shared = (change @ fit.jacobian)[rest]
        whole = float(change @ change)
        return Contribution(whole, max(whole - float(shared @ others @ shared), 1e-9))


def _smooth(count: int) -> Array:
    """Return the Cholesky factor of a term's prior covariance (squared exponential, variance 1)."""
    distance = np.subtract.outer(np.arange(count), np.arange(count)) / SMOOTH
    return np.asarray(np.linalg.cholesky(np.exp(-0.5 * distance**2) + 1e-6 * np.eye(count)))
