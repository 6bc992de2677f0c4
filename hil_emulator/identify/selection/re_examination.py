"""Whether earlier effects are still needed: beside a later one, or beside an unknown one.

The first name goes to what explains the most of everything that is missing. Where one of the
effects that act is in no catalogue, or follows another law, a known one may explain something of
it and of the others at once: what it stands for shows once a free term takes its place.
"""

from collections.abc import Callable
from dataclasses import replace

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.selection.evidence import GREATER_PART
from hil_emulator.identify.selection.law_form import ConditionalTest, own_terms
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Projection, score_of


def re_examine(fitter: Fitter, search: Search, tell: Callable[[str], None]) -> None:
    """Drop an earlier effect that the last one has made superfluous.

    Args:
        fitter: with the training data; its gains are frozen anew.
        search: with an effect just taken into the model.
        tell: takes progress in words.

    """
    if len(search.effects) < 2:
        return
    full = search.settle(converge(fitter, search.free, search.at, search.effects, 1))
    for name in [c.name for c in search.effects[:-1]]:
        kept = {c.name for c in search.without(name)}
        stay = [i for i, c in enumerate(full.coordinates) if c.name in kept]
        rest = [full.coordinates[i] for i in stay]
        fit = fitter.fit(rest, full.at[stay], 2, jacobian=full.jacobian[:, stay])
        if fit.chi2 - full.chi2 < search.rounds[-1].needed:
            search.remove(name, "named, later superfluous")
            search.adopt(fit)
            tell(f"{name} is no longer needed")
            return


def standing(fitter: Fitter, search: Search, fit: Fit, name: str) -> float:
    """Return what the model loses in chi-square without one of its effects, refitted."""
    kept = {c.name for c in search.without(name)}
    stay = [i for i, c in enumerate(fit.coordinates) if c.name in kept]
    rest = [fit.coordinates[i] for i in stay]
    without = fitter.fit(rest, fit.at[stay], 3, jacobian=fit.jacobian[:, stay])
    return without.chi2 - fit.chi2


def redundant(search: Search, found: Round) -> tuple[Coordinate, str] | None:
    """Return an effect whose work a free term of what remains does as well, and that term.

    The term is the strongest that is no law of an effect in the model. It counts against an effect
    only where it explains, beside it, something of the same order.

    Args:
        search: with effects in the model.
        found: the round after the last of them.

    """
    owned = own_terms(found.base, [c.name for c in search.effects], found.significant)
    terms = [t for t in found.worthwhile if t.title not in owned]
    if not terms:
        return None
    term = max(terms, key=lambda t: t.surplus)
    for effect in search.effects:
        without, column = _without(found.base, effect)
        score = score_of(effect, column, Projection(without))
        least = GREATER_PART * score.statistic
        if term.surplus > least > ConditionalTest([term], without).candidate(score):
            return effect, term.title
    return None


def _without(fit: Fit, effect: Coordinate) -> tuple[Fit, Array]:
    """Return the fit with an effect taken out to first order, and the effect's derivative."""
    i = [c.name for c in fit.coordinates].index(effect.name)
    column = fit.jacobian[:, i]
    own = {c.name for c in fit.coordinates if c.belongs_to(effect.name)}
    without = fit.without(own)
    return replace(without, residual=fit.residual - fit.at[i] * column), column
