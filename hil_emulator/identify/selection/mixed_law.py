"""Laws between two of the catalogue: an effect and a near rival that share its work.

Play of several elements, named as that of one, leaves something that a hysteresis explains, which
had explained nearly as much in its place: it completes that law, and is no further effect. Beside
an effect that was fitted alone no sensitivity shows the rival: a little of it does harm as long as
the effect does all the work. A refit that begins with part of the work on each side shows it. And
what such a law leaves may be refused as an effect of its own: it is a part of that law as well.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.prediction.parallel.pool import Batch
from hil_emulator.identify.selection.evidence import LEAST_HELD_OUT
from hil_emulator.identify.selection.levels import GREATER_PART, LAW_TOLERANCE, SMALL_PART
from hil_emulator.identify.selection.progress import Completion, RivalStart, Round, Search
from hil_emulator.identify.selection.rivals import rival_start

RIVAL_SHARE = 0.25
"""Part of the work with which the rival begins (assumed)."""

SHARED_ITERATIONS = 6
"""Of the refit of both (assumed)."""


def mixed_laws(
    fitter: Fitter, search: Search, held: Callable[[], Batch | None]
) -> dict[str, Completion]:  # fmt: skip
    """Return, by effect in the model, the rival that only completes its law.

    Args:
        fitter: with the training data, frozen at the last round.
        search: a finished one.
        held: freezes the validation data, if there are any; seldom is there a rival to ask about.

    """
    base = search.rounds[-1].base
    found: dict[str, Completion] = {}
    for first, rival in _near(search):
        name = first.trials[0].score.coordinate.name
        if rival in _names(base):
            continue
        both = _shared(fitter, base, name, rival_start(first, rival))
        part = (base.chi2 - both.chi2) / first.trials[0].evidence.delta_chi2
        if part < SMALL_PART and _certain(fitter, base, both, held, search.rounds[-1].needed):
            found.setdefault(name, Completion(name, rival, part))
    return found


class Remainder(NamedTuple):
    """What the law of an effect leaves to another one at its place.

    Attributes:
        to: that other effect, which has no name of its own.
        part: what it explains, of what the effect did.

    """

    to: str
    part: float

    def __str__(self) -> str:
        """Say it in words."""
        return f"{self.to} explains {self.part:.0%} more there, and is refused"


def rejected_in_place(search: Search) -> dict[str, Remainder]:
    """Return, by name, the effects that leave a refused one at their place more than chance.

    It explains nothing elsewhere, or less than other shapes do, so it has no name of its own; but
    their laws leave less, if they are the machine's. What explains most of what an effect did is
    no shape of it.
    """
    found: dict[str, Remainder] = {}
    for trial in search.rounds[-1].trials:
        if not trial.evidence.significant:
            continue
        other, explained = trial.score.coordinate, trial.evidence.delta_chi2
        for name in [c.name for c in search.effects if c.place == other.place]:
            left = Remainder(other.name, explained / search.selected_in(name).best)
            most = found.get(name, Remainder("", LAW_TOLERANCE)).part
            if most < left.part < GREATER_PART:
                found[name] = left
    return found


def _near(search: Search) -> Iterator[tuple[Round, str]]:
    """Yield the rounds in which effects were named, with rivals that explained nearly as much."""
    for effect in search.effects:
        found = search.selected_in(effect.name)
        best = found.trials[0]
        parts = {s.coordinate.name: s.statistic / best.score.statistic for s in found.scores}
        parts |= {t.score.coordinate.name: t.evidence.delta_chi2 / best.evidence.delta_chi2
                  for t in found.trials}  # fmt: skip
        for score in found.scores:
            rival = score.coordinate
            here = rival.name != effect.name and rival.place == effect.place
            if here and parts[rival.name] > GREATER_PART:
                yield found, rival.name


def _names(fit: Fit) -> set[str]:
    return {c.name for c in fit.coordinates}


def _shared(fitter: Fitter, base: Fit, name: str, rival: RivalStart) -> Fit:
    """Return the model with both, fitted from where they share the work."""
    own, start = rival
    at = np.append(base.at, start)
    at[[c.name for c in base.coordinates].index(name)] *= 1.0 - RIVAL_SHARE
    # the linearisation at zero may lead far beyond the sizes that occur
    at[-1] = RIVAL_SHARE * np.clip(at[-1], -1.0, 1.0)
    return fitter.fit([*base.coordinates, *own], at, SHARED_ITERATIONS)


def _certain(
    fitter: Fitter, base: Fit, both: Fit, held_out: Callable[[], Batch | None], needed: float
) -> bool:
    """Tell whether both explain more than one, beyond chance and on data that took no part."""
    delta_chi2 = base.chi2 - both.chi2
    widened = fitter.clusters.variance_factor(base.residual - both.residual, both.residual)
    if delta_chi2 < needed * widened:
        return False
    held = held_out()
    if held is None:
        return True
    before = fitter.residual(base.coordinates, base.at, held)
    after = fitter.residual(both.coordinates, both.at, held)
    return float(before @ before - after @ after) > LEAST_HELD_OUT
