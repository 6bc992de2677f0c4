"""What speaks against the law of a named effect: a free shape does more, or it costs too much."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit
from hil_emulator.identify.selection.evidence import SMALL_PART, Trial
from hil_emulator.identify.selection.law_form import own_terms
from hil_emulator.identify.selection.progress import Round

STRAINED = 2.5
"""Prior standard deviations that a data sheet is believed to be off by at most (assumed)."""

AT_END = 0.05
"""Prior standard deviations from the end of its range that a shape parameter counts as there
(assumed)."""

TIED = 0.5
"""Correlation from which a parameter and an effect make up for each other (assumed)."""


def outdone(trial: Trial, found: Round) -> tuple[float, str]:
    """Return how many times as much a term of the named effect's balance explained, and say so.

    It is 1 without words where no such term explains clearly more.

    Args:
        trial: the effect that was accepted.
        found: the round in which it was.

    """
    name, delta_chi2 = trial.score.coordinate.name, trial.evidence.delta_chi2
    for title in own_terms(trial.fit, [name], found.significant):
        term = next(t for t in found.significant if t.title == title)
        if term.surplus - delta_chi2 > max(SMALL_PART * delta_chi2, term.limit):
            ratio = term.statistic / delta_chi2
            return ratio, f"a free term in the {title} explains {ratio:.1f} times as much"
    return 1.0, ""


def strained(fit: Fit, effects: Sequence[str]) -> dict[str, str]:
    """Return, by effect, a parameter that its law needs at a size hardly believed.

    An ordinary one far from what is configured, or one of its own at the end of its range.

    Args:
        fit: the finished model.
        effects: names of the effects in the model.

    """
    found = _at_limits(fit, effects)
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


def _at_limits(fit: Fit, effects: Sequence[str]) -> dict[str, str]:
    """Return, by effect, a shape parameter that has run to the end of its range."""
    found: dict[str, str] = {}
    for coordinate, at in zip(fit.coordinates, fit.at, strict=True):
        effect, _, shape = coordinate.name.rpartition(".")
        low, high = coordinate.bounds
        if effect in effects and min(at - low, high - at) <= AT_END * coordinate.prior:
            end = "lowest" if at - low < high - at else "largest"
            found[effect] = f"its {shape.replace('_', ' ')} would have to be the {end} there is"
    return found
