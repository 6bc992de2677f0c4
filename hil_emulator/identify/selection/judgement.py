"""Whether the best candidate of a round is named, and whether the law of what was named fits."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.selection.certainty import standing
from hil_emulator.identify.selection.evidence import SMALL_PART, Trial
from hil_emulator.identify.selection.law_between import completions
from hil_emulator.identify.selection.law_form import (
    OUTSHONE,
    overshadowed,
    own_terms,
    sole_laws,
    stands_beside,
)
from hil_emulator.identify.selection.progress import Round, Search

INEXACT = 0.01
"""Part of what an effect gained when it was named that a further one must gain (assumed): no law is
so exact that less could not be what it leaves."""

DIFFERENT = 0.05
"""Part of what the model would lose without an effect that a free shape of its law may still gain
before its form differs (assumed)."""

STRAINED = 2.5
"""Prior standard deviations that a data sheet is believed to be off by at most (assumed)."""

TIED = 0.5
"""Correlation from which a parameter and an effect make up for each other (assumed)."""


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


def _named_for(search: Search) -> float:
    """Return the most that an effect in the model gained when it was named."""
    return max((trials[0].evidence.delta_chi2 for trials in search.selections), default=0.0)


def laws(fitter: Fitter, search: Search) -> dict[str, str]:
    """Return why the laws of effects in the model are others than the catalogue's, by name.

    Args:
        fitter: with the training data, frozen at the last round.
        search: a finished one.

    """
    last = search.rounds[-1]
    names = [c.name for c in search.effects]
    owners = sole_laws(last.base, names, last.significant)
    owners |= own_terms(last.base, names, last.significant)
    strains = strained(last.base, names)
    forms = {}
    for name in names:
        own = [t for t in last.significant if owners.get(t.title) == name]
        term = max(own, key=lambda t: t.statistic, default=None)
        left = term.surplus if term else 0.0
        stands = standing(fitter, search, last.base, name) if term else 0.0
        objection = search.outdone.get(name, "")
        if term and left > DIFFERENT * stands:
            part = 100.0 * left / (left + stands)
            forms[name] = f"a free term in the {term.title} explains {part:.0f} % more"
        elif name in search.between:
            forms[name] = str(search.between[name])
        elif objection or name in strains:
            forms[name] = objection or strains[name]
    return forms


def outdone(trial: Trial, found: Round) -> str:
    """Say how many times as much a term of the named effect's balance explained.

    "" where no such term explains clearly more.

    Args:
        trial: the effect that was accepted.
        found: the round in which it was.

    """
    name, delta_chi2 = trial.score.coordinate.name, trial.evidence.delta_chi2
    for title in own_terms(trial.fit, [name], found.significant):
        term = next(t for t in found.significant if t.title == title)
        if term.surplus - delta_chi2 > max(SMALL_PART * delta_chi2, term.limit):
            ratio = term.statistic / delta_chi2
            return f"a free term in the {title} explains {ratio:.1f} times as much"
    return ""


def strained(fit: Fit, effects: Sequence[str]) -> dict[str, str]:
    """Return, by effect, an ordinary parameter that its law needs far from what is configured.

    Args:
        fit: the finished model.
        effects: names of the effects in the model.

    """
    found: dict[str, str] = {}
    names = [c.name for c in fit.coordinates]
    covariance = fit.covariance()
    spread = np.sqrt(np.diag(covariance))
    for i, (coordinate, at) in enumerate(zip(fit.coordinates, fit.at, strict=True)):
        own = coordinate.name.partition(".")[0] in effects or not np.isfinite(coordinate.prior)
        if own or abs(at) < STRAINED * coordinate.prior:
            continue
        share = float(coordinate.value(float(at))) / coordinate.neutral
        for effect in effects:
            j = names.index(effect)
            if abs(covariance[i, j]) > TIED * spread[i] * spread[j]:
                found.setdefault(
                    effect,
                    f"{coordinate.name} would have to be {share:.2g} times its configured value",
                )
    return found


def hardly_believed(fit: Fit) -> list[str]:
    """Return the ordinary parameters that are far from what is configured, each in words."""
    return [
        f"{c.name} is {float(c.value(float(at))) / c.neutral:.2g} times its configured value"
        for c, at in zip(fit.coordinates, fit.at, strict=True)
        if np.isfinite(c.prior) and c.neutral and abs(at) > STRAINED * c.prior
    ]
