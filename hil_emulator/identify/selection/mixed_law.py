"""Test for laws between two of the catalogue: a named effect and a rival that share its action.

Backlash of several elements, named as one backlash, leaves a residual that the rival hysteresis
explains. The rival then completes the law and is not a further effect. At the fit with the effect
alone the rival's sensitivity may not show this; a refit that starts with a share of the action on
both sides does. A rejected candidate at the place of a named effect is counted as lack of fit, too.
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
"""Share of the action with which the rival starts (assumed)."""

SHARED_ITERATIONS = 6
"""Iterations of the refit with both (assumed)."""


def mixed_laws(
    fitter: Fitter, search: Search, held: Callable[[], Batch | None]
) -> dict[str, Completion]:  # fmt: skip
    """Return, by effect in the model, a rival that completes its law.

    Args:
        fitter: with the training data, frozen at the last round.
        search: finished.
        held: freezes the validation data, or returns None without any; called only for a rival.

    """
    base = search.rounds[-1].base
    completions: dict[str, Completion] = {}
    for named, rival in _near(search):
        name = named.trials[0].score.coordinate.name
        if rival in _names(base):
            continue
        both = _shared(fitter, base, name, rival_start(named, rival))
        part = (base.chi2 - both.chi2) / named.trials[0].evidence.delta_chi2
        if part < SMALL_PART and _significant(fitter, base, both, held, search.rounds[-1].needed):
            completions.setdefault(name, Completion(name, rival, part))
    return completions


class Remainder(NamedTuple):
    """Gain of a rejected candidate at the place of a named effect.

    Attributes:
        candidate: name of the rejected candidate.
        part: its gain over that of the named effect.

    """

    candidate: str
    part: float

    def __str__(self) -> str:
        """Return the reason why the law of the named effect does not fit."""
        return f"the rejected {self.candidate} explains {self.part:.0%} more at the same place"


def rejected_in_place(search: Search) -> dict[str, Remainder]:
    """Return, by named effect, the significant but rejected candidate at its place.

    A gain beyond `LAW_TOLERANCE` shows that the law of the named effect does not fit. A candidate
    that explains most of what the effect did is not a part of its law.
    """
    remainders: dict[str, Remainder] = {}
    for trial in search.rounds[-1].trials:
        if not trial.evidence.significant:
            continue
        other, explained = trial.score.coordinate, trial.evidence.delta_chi2
        for name in [c.name for c in search.effects if c.place == other.place]:
            remainder = Remainder(other.name, explained / search.selected_in(name).best)
            largest = remainders.get(name, Remainder("", LAW_TOLERANCE)).part
            if largest < remainder.part < GREATER_PART:
                remainders[name] = remainder
    return remainders


def _near(search: Search) -> Iterator[tuple[Round, str]]:
    """Yield the rounds in which effects were named, with rivals that explained nearly as much."""
    for effect in search.effects:
        named = search.selected_in(effect.name)
        best = named.trials[0]
        parts = {s.coordinate.name: s.statistic / best.score.statistic for s in named.scores}
        parts |= {t.score.coordinate.name: t.evidence.delta_chi2 / best.evidence.delta_chi2
                  for t in named.trials}  # fmt: skip
        for score in named.scores:
            rival = score.coordinate
            same_place = rival.name != effect.name and rival.place == effect.place
            if same_place and parts[rival.name] > GREATER_PART:
                yield named, rival.name


def _names(fit: Fit) -> set[str]:
    return {c.name for c in fit.coordinates}


def _shared(fitter: Fitter, base: Fit, name: str, rival: RivalStart) -> Fit:
    """Return a fit with the effect and its rival, started where both share the action."""
    added, start = rival
    at = np.append(base.at, start)
    at[[c.name for c in base.coordinates].index(name)] *= 1.0 - RIVAL_SHARE
    # the linearisation at zero may lead far beyond realistic sizes
    at[-1] = RIVAL_SHARE * np.clip(at[-1], -1.0, 1.0)
    return fitter.fit([*base.coordinates, *added], at, SHARED_ITERATIONS)


def _significant(
    fitter: Fitter, base: Fit, both: Fit, held_out: Callable[[], Batch | None], needed: float
) -> bool:
    """Return whether the fit with both is significantly better, on held-out data as well."""
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
