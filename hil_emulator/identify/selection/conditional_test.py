"""Further effects beside the law of a named one that does not fit.

What a law of another form leaves is larger than many an effect, and resembles others that do not
act. Free shapes of that law take it up; what still explains something then is something else.
"""

from collections.abc import Collection, Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.selection.evidence import GREATER_PART, ranked
from hil_emulator.identify.selection.free_terms import DiscrepancyTerm
from hil_emulator.identify.selection.law_form import acts_in, directions
from hil_emulator.identify.selection.progress import Round
from hil_emulator.identify.selection.scan import Projection, Score

PARSIMONIOUS = 0.7
"""Part of what a free shape of the law of an effect in the model would gain, that another effect
must gain to be named in its place (assumed)."""

OUTSHONE = 3.0
"""How many times as much as the best effect a free term may explain, chance set aside, for it to be
the one (assumed; laws of another form stay below two)."""

LEFT = 1e-4
"""Part of its information that something must keep beside free terms to be told from them
(assumed)."""


class ConditionalTest:
    """What something explains that no correction of given laws could.

    Args:
        laws: terms that are free to take any shape.
        fit: without what is asked about.

    """

    def __init__(self, laws: Sequence[DiscrepancyTerm], fit: Fit) -> None:
        self._project = Projection(fit)
        self._columns = np.column_stack([self._project(c) for t in laws for c in t.columns.T])
        self._basis = directions(self._columns)
        self._rest = self._basis.T @ (self._columns.T @ self._project.residual)

    def candidate(self, score: Score) -> float:
        """Return the gain in chi-square of a candidate of any size."""
        own = score.column.astype(np.float64)
        mine = self._basis.T @ (self._columns.T @ own)
        information = float(own @ own - mine @ mine)
        if information <= LEFT * score.information:
            return 0.0
        return float(own @ self._project.residual - mine @ self._rest) ** 2 / information

    def term(self, term: DiscrepancyTerm) -> float:
        """Return the gain in chi-square of a free term."""
        columns = np.column_stack([self._project(c) for c in term.columns.T])
        mine = self._basis.T @ (self._columns.T @ columns)
        values, vectors = np.linalg.eigh(columns.T @ columns - mine.T @ mine)
        there = values > LEFT * float(np.max(np.sum(np.square(columns), axis=0)))
        gradient = columns.T @ self._project.residual - mine.T @ self._rest
        return float(np.sum((vectors[:, there].T @ gradient) ** 2 / values[there]))

    def stands_out(self, score: Score, needed: float) -> bool:
        """Tell whether a candidate keeps enough of its gain, and enough for a name."""
        return self.candidate(score) > max(needed, GREATER_PART * score.statistic)


def overshadowed(found: Round, laws: Sequence[DiscrepancyTerm]) -> bool:
    """Tell whether a free shape of a law in the model explains more than the best candidate."""
    best = found.best
    return any(best < PARSIMONIOUS * t.surplus or _of_one_sensor(found, t) for t in laws)


def stands_beside(found: Round, laws: Sequence[DiscrepancyTerm], without: Collection[str]) -> bool:
    """Put the best candidate first that stands out beside given laws; tell whether it is named.

    For that it has to explain, beside them, what any other free term does; in the balance of such a
    law, what that does.

    Args:
        found: a round.
        laws: terms of it that are laws of effects in the model.
        without: names of candidates that complete such a law.

    """
    beside = ConditionalTest(laws, found.base)
    there = ranked([t for t in found.trials if t.score.coordinate.name not in without
                    and beside.stands_out(t.score, found.needed)])  # fmt: skip
    found.trials = there + [t for t in found.trials if t not in there]
    if not there or not there[0].evidence.passed:
        return False
    first = there[0]
    most = OUTSHONE * beside.candidate(first.score)
    rest = [beside.term(t) - t.limit for t in found.worthwhile if t not in laws]
    # what acts where that law does may be a part of it
    rest += [t.certain for t in laws if acts_in(first.score.coordinate, t.balance)]
    return all(explained <= most for explained in rest)


def _of_one_sensor(found: Round, term: DiscrepancyTerm) -> bool:
    """Tell whether the best candidate is another error of the sensor that a term is about."""
    channel = found.trials[0].score.coordinate.channel if found.trials else ""
    return bool(channel) and channel == term.balance.channel
