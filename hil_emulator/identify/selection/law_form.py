"""Test whether a residual is the lack of fit of a named law or a further effect.

A leak proportional to the root of the pressure difference, named as a laminar leak, leaves a
residual in the same balance over the same regressor. A further effect of the catalogue would be a
wrong name for it. A candidate is therefore accepted only if it explains something that no free
shape of a named law explains.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.free_terms.term_matching import (
    acts_in,
    calibrates,
    depends_on,
    is_constant,
    is_curve,
    is_part,
)
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import Trial, ranked
from hil_emulator.identify.selection.levels import (
    GREATER_PART,
    LAW_TOLERANCE,
    NEARLY_ALL,
    SMALL_PART,
)
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Score

LEAST_REMAINING = 1e-4
"""Share of the information that must remain after free terms are projected out; below it a
candidate is collinear with them (assumed)."""

MOST_UNTRIED = 2
"""Largest number of candidates that are refitted because they are independent of named laws."""

MOST_NEAREST = 2
"""Largest number of effects that are reported as nearest to an unexplained term."""


def terms_of_laws(
    fit: Fit, effects: Collection[str], terms: Sequence[DiscrepancyTerm]
) -> dict[str, str]:  # fmt: skip
    """Return, by term, the named effect whose law it may belong to.

    | balance | regressor | condition |
    | --- | --- | --- |
    | of the effect | of its law | always |
    | of the effect | other | reproduces most of the effect's sensitivity |
    | other | other than time | as above, and gains no more than a term in the effect's balance |
    | other | time | never |

    Args:
        fit: with the effects in it.
        effects: names of effects in the model.
        terms: scored at this fit.

    Returns:
        {term's title: effect's name}, the effect whose sensitivity the term reproduces best.

    """
    indices = {c.name: i for i, c in enumerate(fit.coordinates) if c.name in effects}
    in_balance = {
        effect: max((t.statistic for t in terms if acts_in(fit.coordinates[i], t.balance)),
                    default=0.0) for effect, i in indices.items()
    }  # fmt: skip
    owners: dict[str, tuple[float, str]] = {}
    for term in terms if indices else ():
        columns = term.columns.astype(np.float64)
        basis = directions(columns)
        for effect, i in indices.items():
            same_balance = acts_in(fit.coordinates[i], term.balance)
            if same_balance and not is_part(term, fit.coordinates[i]):
                continue
            may_mimic = term.regressor != "time" and term.statistic <= in_balance[effect]
            if not same_balance and not may_mimic:
                continue
            sensitivity = fit.jacobian[:, i]
            power = float(sensitivity @ sensitivity)
            reproduced = basis.T @ (columns.T @ sensitivity)
            share = float(reproduced @ reproduced) / power if power > 0.0 else 0.0
            of_law = same_balance and depends_on(fit.coordinates[i], term.regressor)
            if share > max(0.0 if of_law else GREATER_PART, owners.get(term.title, (0.0, ""))[0]):
                owners[term.title] = (share, effect)
    return {title: effect for title, (_, effect) in owners.items()}


def directions(columns: Array) -> Array:
    """Return the matrix W that makes columns @ W orthonormal, without nearly collinear directions.

    The product itself is not computed, since the columns of a long recording are large.
    """
    normal = columns.T @ columns
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-24))
    values, vectors = np.linalg.eigh(normal * np.outer(scale, scale))
    kept = values > 1e-4 * values[-1]
    return np.asarray(scale[:, None] * vectors[:, kept] / np.sqrt(values[kept]))


def nearest(term: DiscrepancyTerm, scores: Sequence[Score]) -> str:
    """Return the candidate of the term's balance that is most similar to the term, or "".

    Candidates whose law depends on the term's regressor come first. If a second one of them
    explains nearly as much, both are named: "fixed_pump or variable_pump".

    Args:
        term: the unexplained term.
        scores: of the candidates, best first.

    """
    similar = [s for s in scores if s.statistic > 0.0 and acts_in(s.coordinate, term.balance)]
    similar.sort(key=lambda s: not depends_on(s.coordinate, term.regressor))
    rivals = [s for s in similar if s.statistic > NEARLY_ALL * similar[0].statistic
              and depends_on(s.coordinate, term.regressor)]  # fmt: skip
    return " or ".join(s.coordinate.name for s in (rivals or similar)[:MOST_NEAREST])


def displacing(effects: Sequence[Coordinate], fit: Fit) -> dict[str, str]:
    """Return, by name, effects that replace a configured law of their stage, with the reason.

    A configured effect whose fitted size is nearly zero shows that the named law has the wrong
    form: no machine lacks the dry friction that it is configured with.
    """
    return {
        effect.name: f"with it, the fitted {ordinary.name} is nearly zero"
        for ordinary, at in zip(fit.coordinates, fit.at, strict=True)
        if _nearly_absent(ordinary, float(at))
        for effect in effects if effect.stage == ordinary.stage
    }  # fmt: skip


def _nearly_absent(ordinary: Coordinate, at: float) -> bool:
    if ordinary.effect is None or not ordinary.is_knob or not np.isfinite(ordinary.prior):
        return False
    off = ordinary.effect.off
    return abs(ordinary.value(at) - off) < SMALL_PART * abs(ordinary.neutral - off)


class ConditionalTest:
    """Gains in chi-square conditional on free shapes of given laws.

    Args:
        laws: free terms that are projected out.
        fit: without the candidates to be tested.

    """

    def __init__(self, laws: Sequence[DiscrepancyTerm], fit: Fit) -> None:
        self._terms, self._project = list(laws), Projection(fit)
        self._columns = np.column_stack([self._project(c) for t in laws for c in t.columns.T])
        self._basis = directions(self._columns)
        self._residual_in_laws = self._basis.T @ (self._columns.T @ self._project.residual)

    def candidate(self, score: Score) -> float:
        """Return the gain in chi-square of a candidate at its best size."""
        column = score.column.astype(np.float64)
        in_laws = self._basis.T @ (self._columns.T @ column)
        information = float(column @ column - in_laws @ in_laws)
        if information <= LEAST_REMAINING * score.information:
            return 0.0
        gradient = float(column @ self._project.residual - in_laws @ self._residual_in_laws)
        return gradient**2 / information

    def term(self, term: DiscrepancyTerm) -> float:
        """Return the gain in chi-square of a free term."""
        columns = np.column_stack([self._project(c) for c in term.columns.T])
        in_laws = self._basis.T @ (self._columns.T @ columns)
        values, vectors = np.linalg.eigh(columns.T @ columns - in_laws.T @ in_laws)
        kept = values > LEAST_REMAINING * float(np.max(np.sum(np.square(columns), axis=0)))
        gradient = columns.T @ self._project.residual - in_laws.T @ self._residual_in_laws
        return float(np.sum((vectors[:, kept].T @ gradient) ** 2 / values[kept]))

    def keeps_its_gain(self, score: Score, needed: float) -> bool:
        """Return whether the conditional gain is nearly the full gain, and significant."""
        return self.candidate(score) > max(needed, NEARLY_ALL * score.statistic)

    def independent(self, score: Score) -> bool:
        """Return whether the candidate's balance has no named law and its gain hardly changes."""
        if any(acts_in(score.coordinate, t.balance) for t in self._terms):
            return False
        gain = self.candidate(score)
        return NEARLY_ALL * max(gain, score.statistic) < min(gain, score.statistic)

    def explained_by_law(self, score: Score) -> bool:
        """Return whether a law in the candidate's balance explains far more than the candidate."""
        here = [t.excess for t in self._terms if acts_in(score.coordinate, t.balance)]
        return bool(here) and self.candidate(score) / GREATER_PART < max(here)


def own_law_explains_more(current: Round, laws: Sequence[DiscrepancyTerm]) -> bool:
    """Return whether a free shape of a named law explains more than the best candidate.

    Both the gain corrected for serial correlation and the plain gain must be smaller than that of
    the shape: the residual of a misfitting law is strongly correlated, which reduces the first.
    """
    robust = current.trials[0].evidence.serial_robust if current.trials else 0.0
    return any(
        _of_same_sensor(current, t)
        or (robust < NEARLY_ALL * t.robust and NEARLY_ALL * current.best < t.excess)
        for t in laws
    )


def free_term_explains_more(current: Round) -> bool:
    """Return whether a free term gains, beyond chance, far more than the best candidate.

    A calibration curve of the candidate's own sensor is excepted: it shows that the error has
    another law, not that it is another effect.
    """
    best = current.trials[0].score.coordinate if current.trials else None
    return any(t.excess > current.best / GREATER_PART for t in current.noticeable
               if best is None or not calibrates(t, best))  # fmt: skip


def independent_of_named_laws(current: Round, laws: Sequence[DiscrepancyTerm]) -> bool:
    """Move candidates that are independent of named laws to the front of the trials.

    Args:
        current: round with at least one such law.
        laws: its terms that are shapes of named laws.

    Returns:
        Whether there is such a candidate and no free term explains far more, both conditional on
        the named laws.

    """
    test = ConditionalTest(laws, current.base)
    independent = ranked(
        [
            t
            for t in current.trials
            if t.evidence.passed
            and test.keeps_its_gain(t.score, current.needed * t.evidence.variance_factor)
            and not test.explained_by_law(t.score)
        ]
    )
    current.trials = independent + [t for t in current.trials if t not in independent]
    if not independent:
        return False
    most = test.candidate(independent[0].score) / GREATER_PART
    return all(test.term(t) - t.limit <= most for t in current.noticeable if t not in laws)


def untried_independent(search: Search, current: Round) -> list[Score]:
    """Return candidates without a refit that are significant conditional on the named laws.

    The residual of a misfitting law gives high scores to candidates in its balance. A significant
    effect elsewhere may then be missing among the refitted candidates.

    Args:
        search: with the effects in the model.
        current: its current round, with the columns of the candidates.

    Returns:
        Scores with the largest conditional gains, best first.

    """
    laws = _laws(search, current, _owners(search, current)) if search.effects else []
    if current.excerpt is None or not own_law_explains_more(current, laws):
        return []
    in_excerpt = [replace(t, columns=current.excerpt.columns(t.columns)) for t in laws]
    test = ConditionalTest(in_excerpt, current.excerpt.fit)
    tried = {t.score.coordinate.name for t in current.trials}
    rest = [s for s in current.scores if s.coordinate.name not in tried]
    gains = [(test.candidate(s), s) for s in rest if test.independent(s)]
    gains.sort(key=lambda pair: -pair[0])
    return [s for gain, s in gains[:MOST_UNTRIED] if gain > current.needed]


def _of_same_sensor(current: Round, term: DiscrepancyTerm) -> bool:
    """Return whether the best candidate is a further error of the sensor of a term."""
    channel = current.trials[0].score.coordinate.channel if current.trials else ""
    return bool(channel) and channel == term.balance.channel


def judge(search: Search, current: Round) -> None:
    """Enter in a round whether its best candidate is accepted, and whether a term is unknown.

    1. If a named law explains more than the best candidate, a candidate must be independent of it.
    2. Otherwise the best candidate must pass its tests, and no free term may explain far more.
    3. A gain that is within the tolerance of a named law is accepted only for a sensor error that
       is independent of the named laws.
    """
    owners = _owners(search, current)
    laws = _laws(search, current, owners)
    if own_law_explains_more(current, laws) and not _constant_force_suffices(current):
        current.accepted = independent_of_named_laws(current, laws)
    else:
        current.accepted = bool(current.trials) and current.trials[0].evidence.passed
        current.accepted &= not free_term_explains_more(current)
    if current.accepted and current.best <= LAW_TOLERANCE * _largest_gain(search):
        of_a_sensor = bool(current.trials[0].score.coordinate.channel)
        current.accepted = of_a_sensor and _independent(current, laws, current.trials[0])
    current.unknown = not current.accepted and any(
        t.title not in owners for t in current.noticeable
    )


def _constant_force_suffices(judged: Round) -> bool:
    """Return whether a constant force explains nearly as much as the best candidate of a bench.

    Only for a balance of forces, which estimates its noise: there every shape over velocity
    contains a constant, while friction, which opposes motion both ways, does not.
    """
    least = NEARLY_ALL * judged.best
    return judged.base.effective is not None and any(
        is_constant(t.score.coordinate) and t.evidence.delta_chi2 > least for t in judged.trials
    )


def _independent(current: Round, laws: Sequence[DiscrepancyTerm], trial: Trial) -> bool:
    """Return whether a candidate is independent of the lack of fit of named laws."""
    return bool(laws) and ConditionalTest(laws, current.base).independent(trial.score)


def _owners(search: Search, current: Round) -> dict[str, str]:
    return terms_of_laws(current.base, [c.name for c in search.effects], current.significant)


def _laws(search: Search, current: Round, owners: Collection[str]) -> list[DiscrepancyTerm]:
    """Return the terms of a round that are shapes of named laws.

    For a sensor error, these include terms of its channel over any regressor but the reading.
    """
    sensors = {c.channel for c in search.effects if c.channel}
    return [t for t in current.significant
            if t.title in owners or (t.balance.channel in sensors and not is_curve(t))]  # fmt: skip


def _largest_gain(search: Search) -> float:
    """Return the largest gain of a named effect in its round; 0 if the noise is estimated.

    Gains for different noise estimates are not comparable.
    """
    return max((trials[0].evidence.delta_chi2 for trials in search.selections
                if trials[0].fit.effective is None), default=0.0)  # fmt: skip
