"""Whether earlier effects are still needed once a later one is in the model."""

from collections.abc import Callable

from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.selection.outer_iteration import converge
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
    full = converge(fitter, search, 1)
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
