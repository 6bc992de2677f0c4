"""Whether the best candidate of a round is named, and whether the law of what was named fits."""

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.selection.completion import completions
from hil_emulator.identify.selection.conditional_test import OUTSHONE, overshadowed, stands_beside
from hil_emulator.identify.selection.law_form import own_terms, sole_laws
from hil_emulator.identify.selection.law_objections import strained
from hil_emulator.identify.selection.progress import Round, Search

OTHER_LAW = 2.0
"""How many times as much as an effect a free term may have explained when it was named, if it still
leaves something in the end; beyond, it is not the one that acts (assumed)."""

INEXACT = 0.01
"""Part of what an effect gained when it was named that a further one must gain (assumed): no law is
so exact that less could not be what it leaves."""

DIFFERENT = 0.05
"""Part of what the model would lose without an effect that a free shape of its law may still gain
before its form differs (assumed)."""

UNKNOWN = 1.0
"""The same, chance set aside, from which on the effect is not the one that acts (assumed)."""


def judge(search: Search, found: Round) -> None:
    """Accept the best candidate of a round, or say that none is justified.

    Where a free term explains far more, none is, nor where an earlier effect explained a hundred
    times as much. Where the law of an effect in the model explains what remains better than any
    candidate does, only a candidate that gains beside a free shape of that law is accepted; what a
    sensor reads over anything counts as such a shape of an error of it. None is that only completes
    the law of one in the model.
    """
    completing = completions(search.selections, found.trials)
    found.trials.sort(key=lambda t: t.score.coordinate.name in completing)
    owners = own_terms(found.base, [c.name for c in search.effects], found.significant)
    sensors = {c.channel for c in search.effects if c.channel}
    own = [t for t in found.significant if t.title in owners or t.balance.channel in sensors]
    if overshadowed(found, own):
        found.accepted = stands_beside(found, own, completing)
    else:
        found.accepted = bool(found.trials) and found.trials[0].evidence.passed
        found.accepted &= all(t.certain <= OUTSHONE * found.best for t in found.worthwhile)
    found.accepted &= found.best > INEXACT * _named_for(search)
    found.accepted &= not completing or found.trials[0].score.coordinate.name not in completing
    search.between = {c.named: c for c in reversed(list(completing.values()))}
    found.unknown = not found.accepted and any(t.title not in owners for t in found.worthwhile)


def laws(fitter: Fitter, search: Search) -> tuple[list[str], dict[str, str]]:
    """Return the effects that are not the ones that act, and why the laws of others differ.

    Args:
        fitter: with the training data, frozen at the last round.
        search: a finished one.

    """
    last = search.rounds[-1]
    names = [c.name for c in search.effects]
    owners = sole_laws(last.base, names, last.significant)
    owners |= own_terms(last.base, names, last.significant)
    strains = strained(last.base, names)
    rejected, forms = [], {}
    for name in names:
        own = [t for t in last.significant if owners.get(t.title) == name]
        term = max(own, key=lambda t: t.statistic, default=None)
        left = term.surplus if term else 0.0
        stands = standing(fitter, search, last.base, name) if term else 0.0
        times, objection = search.outdone.get(name, (1.0, ""))
        differs = term is not None and left > DIFFERENT * stands
        if (term and term.certain > UNKNOWN * stands) or (differs and times > OTHER_LAW):
            rejected.append(name)
        elif term and differs:
            part = 100.0 * left / (left + stands)
            forms[name] = f"a free term in the {term.title} explains {part:.0f} % more"
        elif name in search.between:
            forms[name] = str(search.between[name])
        elif objection or name in strains:
            forms[name] = objection or strains[name]
    return rejected, forms


def standing(fitter: Fitter, search: Search, fit: Fit, name: str) -> float:
    """Return what the model loses in chi-square without one of its effects, refitted."""
    kept = {c.name for c in search.without(name)}
    stay = [i for i, c in enumerate(fit.coordinates) if c.name in kept]
    rest = [fit.coordinates[i] for i in stay]
    without = fitter.fit(rest, fit.at[stay], 3, jacobian=fit.jacobian[:, stay])
    return without.chi2 - fit.chi2


def _named_for(search: Search) -> float:
    """Return the most that an effect in the model gained when it was named."""
    return max((trials[0].evidence.delta_chi2 for trials in search.selections), default=0.0)
