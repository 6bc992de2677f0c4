"""Nothing more, another law of a named effect, or something unknown: one comparison by evidence.

Beside the finished model, a smooth term over any regressor may act in any balance (Kennedy and
O'Hagan 2001). One in the balance of a named effect is what the law of that effect lacks, and likely
small beside the effect; any other is unknown. Which of them are there, the evidence decides.
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
"""Root mean square of what a law lacks over that of its effect, each as likely. A straight law
misses 0.17 of a power law of order 4/7, a turbulent gap; 0.2 of an orifice's, 0.25 of a square one
and 0.4 of a cubic one, as a sensor's odd curve is. Parts of such laws miss less."""

VARIANCE_SHARES = tuple(10.0 ** (0.5 * i) for i in range(-8, 2))
"""Shares of the innovations' variance that an unknown term may have, each as likely: from one in
ten thousand, which chance gives to six hats of a minute's data, to three times all of it."""

SMOOTH = 1.5
"""Hats over which a term is correlated: neighbours by 0.8, the ends of the range by
nothing, so that it bends once or twice, and is neither noise nor a straight line."""

MOST_DISCREPANCIES = 4
"""Most terms beside the model."""


@dataclass(frozen=True)
class Discrepancy:
    """A term beside the model that the evidence asks for.

    Attributes:
        shape: its balance and regressor.
        owner: the named effect whose law it belongs to; "" for something unknown, None for ripple
            of the friction.
        nats: gain in log evidence.
        explained: the same as a chi-square of the training data.

    """

    shape: FreeShape
    owner: str | None
    nats: float
    explained: float


class Contribution(NamedTuple):
    """What an effect makes of the residual, as a chi-square.

    Attributes:
        whole: all of it.
        own: what of it no other coordinate can take over.

    """

    whole: float
    own: float


@dataclass(frozen=True)
class _Option:
    """One way in which a term may be there."""

    variance: float
    log_prior: float
    owner: str | None


class Discrepancies:
    """Terms beside a finished model.

    Args:
        fitter: with the training data, frozen where the model ended.
        fit: the model.
        effects: that were named.
        held: validation data, or None.

    Attributes:
        made: what each effect makes, by name.
        shapes: the terms that may be there.
        found: those that the evidence asks for, the likeliest first.

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
        self.made = {c.name: self._contribution(fitter, c) for c in self._effects}
        self._options = [list(self._ways(i)) for i in range(len(self.shapes))]
        self.found = self._select()

    @property
    def lack_of_fit(self) -> dict[str, float]:
        """What the law of each effect lacks, as a part of what the effect explains, by name."""
        return {c.name: sum(d.explained for d in self.found if d.owner == c.name)
                / self.made[c.name].own for c in self._effects}  # fmt: skip

    def other_laws(self) -> dict[str, str]:
        """Return why the laws of effects are others than the catalogue's, by name.

        What is no word worth elsewhere is none here: every machine has a little of everything.
        """
        forms = {}
        for c in self._effects:
            own = [d for d in self.found if d.owner == c.name and self._noticeable(d)]
            part = sum(d.explained for d in own) / self.made[c.name].own
            if part > LAW_TOLERANCE:
                title = max(own, key=lambda d: d.explained).shape.title
                forms[c.name] = f"a free term in the {title} explains {100.0 * part:.0f} % more"
        return forms

    def unknown(self) -> list[FreeShape]:
        """Return what belongs to no effect and is worth a word, the likeliest first."""
        return [d.shape for d in self.found if not d.owner and self._noticeable(d)]

    def _noticeable(self, d: Discrepancy) -> bool:
        least = NOTICEABLE * self._fit.sample_size / HATS
        return d.explained > least * len(d.shape.knots)

    def _select(self) -> list[Discrepancy]:
        """Return the terms that the evidence asks for, the likeliest first."""
        rows, root = np.zeros(0, dtype=int), np.zeros((0, 0))
        rest = list(range(len(self.shapes)))
        found: list[Discrepancy] = []
        while rest and len(found) < MOST_DISCREPANCIES:
            before = self._evidence(rows, root)
            ways = (self._with(rows, root, before, i) for i in rest)
            nats, i, option = max(ways, key=lambda way: way[0])
            if nats <= 0.0:
                break
            rest.remove(i)
            rows, root = self._beside(rows, root, i, option.variance)
            explained = 2.0 * float(self._inflations[i]) * nats * self._part
            found.append(Discrepancy(self.shapes[i], option.owner, nats, explained))
        return found

    def _with(
        self, rows: Array, root: Array, before: tuple[float, float], i: int
    ) -> tuple[float, int, _Option]:  # fmt: skip
        """Return the nats that one term more gains, and how it is likeliest.

        What the data say along a term counts as much less as they are correlated along it.
        """
        less = self._inflation / self._inflations[i]
        nats = []
        for option in self._options[i]:
            told, free = self._evidence(*self._beside(rows, root, i, option.variance))
            nats.append(option.log_prior + less * (told - before[0]) + free - before[1])
        return float(np.logaddexp.reduce(nats)), i, self._options[i][int(np.argmax(nats))]

    def _beside(self, rows: Array, root: Array, i: int, variance: float) -> tuple[Array, Array]:
        own = math.sqrt(variance) * self._roots[i]
        zeros = np.zeros((len(root), len(own)))
        return np.append(rows, self._rows[i]), np.block([[root, zeros], [zeros.T, own]])

    def _ways(self, i: int) -> Iterator[_Option]:
        """Yield the ways in which a term may be there."""
        shape, rows = self.shapes[i], self._rows[i]
        kernel = self._roots[i] @ self._roots[i].T
        here = np.ix_(rows, rows)
        seen = self._inflation * float(np.sum(kernel * self._evidence.information[here]))
        each = self._fit.sample_size / max(seen, 1e-9)
        owners = [c for c in self._effects if is_part(shape, c)]
        if shape.ripples:
            usual = NOTICEABLE * len(rows) / HATS
            small = [s for s in VARIANCE_SHARES if s <= usual]
            yield from (_Option(s * each, -math.log(2 * len(small)), None) for s in small)
        # what outgrows a law in whose balance it acts still is what that law lacks
        names = [c.name for c in owners] or [""]
        chance = -math.log(len(self.shapes) * len(VARIANCE_SHARES) * len(names))
        yield from (_Option(s * each, chance, name) for name in names for s in VARIANCE_SHARES)
        whole = max(float(np.sum(kernel * self._training.shapes[here])), 1e-9)
        for c in owners:
            places = sum(is_part(s, c) for s in self.shapes)
            chance = -math.log(places * len(LAW_ERROR_SIZES))
            own = self.made[c.name].whole / whole
            yield from (_Option(size**2 * own, chance, c.name) for size in LAW_ERROR_SIZES)

    def _contribution(self, fitter: Fitter, c: Coordinate) -> Contribution:
        """Return what an effect makes, by the model without it.

        Where a law saturates, as a pump's does, its tangent may tell a hundredth or ten times that.
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
    """Return the root of the prior covariance of a term's hats, of variance one."""
    apart = np.subtract.outer(np.arange(count), np.arange(count)) / SMOOTH
    return np.asarray(np.linalg.cholesky(np.exp(-0.5 * apart**2) + 1e-6 * np.eye(count)))
