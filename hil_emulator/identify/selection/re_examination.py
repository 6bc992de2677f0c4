"""Whether an effect in the model is still needed, and what the model would lose without it.

The first name goes to what explains the most of everything that is missing; beside the effects that
were found after it, it may explain nothing.
"""

from collections.abc import Callable

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.selection.progress import Search


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
