"""Whether what remains belongs to the law of an effect that was named already, or stands beside it.

A leak that grows with the root of the pressure difference, named as one that grows with the
pressure difference, leaves a residual in the same balance with the same regressor. The next entry
of the catalogue that resembles this residual would be a wrong name; the right answer is that the
law of the leak is another one. A further effect has to explain something that no free shape of that
law could.
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

LEFT = 1e-4
"""Part of its information that something must keep beside free terms to be told from them
(assumed)."""

MOST_UNTRIED = 2
"""Most candidates that are refitted because they stand out beside a law."""

MOST_NEAREST = 2
"""Most effects that are told as the nearest to something unknown."""


def terms_of_laws(
    fit: Fit, effects: Collection[str], terms: Sequence[DiscrepancyTerm]
) -> dict[str, str]:  # fmt: skip
    """Return, by term, the effect whose law lives there.

    In the balance of a law, a term over what the law looks at is a shape of it; any other term, if
    it reproduces the greater part of what the effect does. Elsewhere it may only mimic one: it
    explains no more than a term in the law's own balance. A term over time is of an effect of its
    balance only: it is no shape of a law elsewhere, however much it resembles what friction does to
    a sensor with a free zero.

    Args:
        fit: with the effects in it.
        effects: names of effects in the model.
        terms: scored at this fit.

    Returns:
        {term's title: effect's name}, the effect whose sensitivity the term reproduces best.

    """
    indices = {c.name: i for i, c in enumerate(fit.coordinates) if c.name in effects}
    at_home = {effect: max((t.statistic for t in terms if acts_in(fit.coordinates[i], t.balance)),
                           default=0.0) for effect, i in indices.items()}  # fmt: skip
    owners: dict[str, tuple[float, str]] = {}
    for term in terms if indices else ():
        columns = term.columns.astype(np.float64)
        basis = directions(columns)
        for effect, i in indices.items():
            there = acts_in(fit.coordinates[i], term.balance)
            if there and not is_part(term, fit.coordinates[i]):
                continue
            mimics = term.regressor != "time" and term.statistic <= at_home[effect]
            if not there and not mimics:
                continue
            sensitivity = fit.jacobian[:, i]
            power = float(sensitivity @ sensitivity)
            shown = basis.T @ (columns.T @ sensitivity)
            share = float(shown @ shown) / power if power > 0.0 else 0.0
            own = there and depends_on(fit.coordinates[i], term.regressor)
            if share > max(0.0 if own else GREATER_PART, owners.get(term.title, (0.0, ""))[0]):
                owners[term.title] = (share, effect)
    return {title: effect for title, (_, effect) in owners.items()}


def directions(columns: Array) -> Array:
    """Return what makes columns orthonormal, without directions that they hardly have.

    Of a long recording the columns are large: they are not multiplied out.
    """
    normal = columns.T @ columns
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-24))
    values, vectors = np.linalg.eigh(normal * np.outer(scale, scale))
    there = values > 1e-4 * values[-1]
    return np.asarray(scale[:, None] * vectors[:, there] / np.sqrt(values[there]))


def nearest(term: DiscrepancyTerm, scores: Sequence[Score]) -> str:
    """Return the candidate of the term's balance that resembles it, or "".

    One whose law depends on the term's regressor comes before any other; those that explain nearly
    as much, and depend on it as well, are named with it: "fixed_pump or variable_pump".

    Args:
        term: the unexplained term.
        scores: of the candidates, best first.

    """
    there = [s for s in scores if s.statistic > 0.0 and acts_in(s.coordinate, term.balance)]
    there.sort(key=lambda s: not depends_on(s.coordinate, term.regressor))
    alike = [s for s in there if s.statistic > NEARLY_ALL * there[0].statistic
             and depends_on(s.coordinate, term.regressor)]  # fmt: skip
    return " or ".join(s.coordinate.name for s in (alike or there)[:MOST_NEAREST])


def displacing(effects: Sequence[Coordinate], fit: Fit) -> dict[str, str]:
    """Return, by name, the effects in whose stage hardly any of a configured law is left, in words.

    Every machine has what it is configured with, more or less of it. A law that takes all of its
    work is one of another form: friction with the square of speed is neither dry nor mixed.
    """
    return {
        effect.name: f"hardly any of the configured {ordinary.name} is left beside it"
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
    """What something explains that no correction of given laws could.

    Args:
        laws: terms that are free to take any shape.
        fit: without what is asked about.

    """

    def __init__(self, laws: Sequence[DiscrepancyTerm], fit: Fit) -> None:
        self._laws, self._project = list(laws), Projection(fit)
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

    def keeps_its_gain(self, score: Score, needed: float) -> bool:
        """Tell whether a candidate keeps nearly all of its gain, and enough for a name."""
        return self.candidate(score) > max(needed, NEARLY_ALL * score.statistic)

    def elsewhere(self, score: Score) -> bool:
        """Tell whether a candidate acts in no law's balance, and explains beside them the same."""
        if any(acts_in(score.coordinate, t.balance) for t in self._laws):
            return False
        gain = self.candidate(score)
        return NEARLY_ALL * max(gain, score.statistic) < min(gain, score.statistic)

    def explained_by_law(self, score: Score) -> bool:
        """Tell whether a law explains far more than a candidate that acts where that law does."""
        here = [t.excess for t in self._laws if acts_in(score.coordinate, t.balance)]
        return bool(here) and self.candidate(score) / GREATER_PART < max(here)


def own_law_explains_more(found: Round, laws: Sequence[DiscrepancyTerm]) -> bool:
    """Tell whether a free shape of a law in the model explains more than the best candidate.

    What a law leaves lasts, and little of a gain is certain beside it. Yet what gains more than any
    shape of it, certain or not, is none of it.
    """
    sure = found.trials[0].evidence.serial_robust if found.trials else 0.0
    return any(
        _of_one_sensor(found, t)
        or (sure < NEARLY_ALL * t.robust and NEARLY_ALL * found.best < t.excess)
        for t in laws
    )


def free_term_explains_more(found: Round) -> bool:
    """Tell whether a free term explains far more than the best candidate, chance set aside.

    That a sensor is off by more at one reading than at another speaks against the law of its error,
    not against the sensor.
    """
    best = found.trials[0].score.coordinate if found.trials else None
    return any(t.excess > found.best / GREATER_PART for t in found.noticeable
               if best is None or not calibrates(t, best))  # fmt: skip


def independent_of_named_laws(found: Round, laws: Sequence[DiscrepancyTerm]) -> bool:
    """Put the best one first that is justified beside given laws; tell whether it is named.

    For that it has to explain, beside them, what any other free term does; in the balance of such a
    law, what that does.

    Args:
        found: a round.
        laws: terms of it that are laws of effects in the model.

    """
    beside = ConditionalTest(laws, found.base)
    there = ranked(
        [
            t
            for t in found.trials
            if t.evidence.passed
            and beside.keeps_its_gain(t.score, found.needed * t.evidence.variance_factor)
            and not beside.explained_by_law(t.score)
        ]
    )
    found.trials = there + [t for t in found.trials if t not in there]
    if not there:
        return False
    most = beside.candidate(there[0].score) / GREATER_PART
    return all(beside.term(t) - t.limit <= most for t in found.noticeable if t not in laws)


def untried_independent(search: Search, found: Round) -> list[Score]:
    """Return the candidates that nobody has refitted yet and that stand out beside given laws.

    A law that does not fit leaves what candidates at its place explain the most of; what acts
    elsewhere is not among the likeliest then, however plain it is.

    Args:
        search: with the effects in the model.
        found: a round of it, with the columns of its candidates.

    Returns:
        Those that gain the most beside the laws, the best first.

    """
    laws = _laws(search, found, _owners(search, found)) if search.effects else []
    if found.excerpt is None or not own_law_explains_more(found, laws):
        return []
    there = [replace(t, columns=found.excerpt.columns(t.columns)) for t in laws]
    beside = ConditionalTest(there, found.excerpt.fit)
    tried = {t.score.coordinate.name for t in found.trials}
    rest = [s for s in found.scores if s.coordinate.name not in tried]
    gains = [(beside.candidate(s), s) for s in rest if beside.elsewhere(s)]
    gains.sort(key=lambda told: -told[0])
    return [s for gain, s in gains[:MOST_UNTRIED] if gain > found.needed]


def _of_one_sensor(found: Round, term: DiscrepancyTerm) -> bool:
    """Tell whether the best candidate is another error of the sensor that a term is about."""
    channel = found.trials[0].score.coordinate.channel if found.trials else ""
    return bool(channel) and channel == term.balance.channel


def judge(search: Search, found: Round) -> None:
    """Accept the best candidate of a round, or say that none is justified.

    Where a free term explains far more, none is, nor where it explains no more than the law of an
    earlier effect may leave, unless it is a sensor's error apart from that law. Where the law of an
    effect in the model explains what remains better than any candidate does, only one that gains
    beside a free shape of that law is accepted; what a sensor reads over anything counts as such a
    shape of an error of it.
    """
    owners = _owners(search, found)
    own = _laws(search, found, owners)
    if own_law_explains_more(found, own) and not _constant_force_suffices(found):
        found.accepted = independent_of_named_laws(found, own)
    else:
        found.accepted = bool(found.trials) and found.trials[0].evidence.passed
        found.accepted &= not free_term_explains_more(found)
    if found.accepted and found.best <= LAW_TOLERANCE * _largest_gain(search):
        of_a_sensor = bool(found.trials[0].score.coordinate.channel)
        found.accepted = of_a_sensor and _apart(found, own, found.trials[0])
    found.unknown = not found.accepted and any(t.title not in owners for t in found.noticeable)


def _constant_force_suffices(judged: Round) -> bool:
    """Return whether a constant force explains nearly all that the best candidate of a bench does.

    On a balance of forces, which alone estimates its noise, any shape over velocity holds a
    constant. Friction acts against the motion, so that motion both ways separates the two.
    """
    least = NEARLY_ALL * judged.best
    return judged.base.effective is not None and any(
        is_constant(t.score.coordinate) and t.evidence.delta_chi2 > least for t in judged.trials
    )


def _apart(found: Round, laws: Sequence[DiscrepancyTerm], trial: Trial) -> bool:
    """Tell whether a candidate has nothing to do with what laws in the model leave."""
    return bool(laws) and ConditionalTest(laws, found.base).elsewhere(trial.score)


def _owners(search: Search, found: Round) -> dict[str, str]:
    return terms_of_laws(found.base, [c.name for c in search.effects], found.significant)


def _laws(search: Search, found: Round, owners: Collection[str]) -> list[DiscrepancyTerm]:
    """Return the terms of a round that are shapes of the laws of effects in the model."""
    sensors = {c.channel for c in search.effects if c.channel}
    return [t for t in found.significant
            if t.title in owners or (t.balance.channel in sensors and not is_curve(t))]  # fmt: skip


def _largest_gain(search: Search) -> float:
    """Return the most that an effect in the model gained when it was named.

    Gains by a noise that is estimated in each round anew cannot be compared.
    """
    return max((trials[0].evidence.delta_chi2 for trials in search.selections
                if trials[0].fit.effective is None), default=0.0)  # fmt: skip
