"""Rivals at the same place that stand for much of an effect whose law does not fit.

By how much a law misses that of the machine depends on its shape. Of two laws that both miss it,
the one that explains more need not be that of the effect that acts. The same holds where an effect
was chosen beside another one that was since taken out of the model.
"""

import numpy as np

from hil_emulator.identify.estimation.map_fit import Fit, Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant_model import Coordinate
from hil_emulator.identify.selection.distinguishability import weighed
from hil_emulator.identify.selection.evidence import GREATER_PART
from hil_emulator.identify.selection.progress import Round, Search, StandIn
from hil_emulator.identify.selection.scan import Score

TRIED = 4
"""Rivals that are tried, the likeliest first; those that bring states along come on top."""

PASSES = 4
"""Times that the gains are computed anew on the way of a rival."""

STAND_IN_ITERATIONS = 6
"""Iterations of a refit in between."""

MOST_TOLD = 2
"""Rivals beside which further ones of this kind are not told: a longer list names nothing."""


def near_rivals(fitter: Fitter, search: Search, found: Round) -> dict[str, StandIn]:
    """Return the rivals that explain much of the same in an effect's place, the best first.

    Gains that were frozen without a rival do not correct the states that it brings along, and a
    refit then hardly finds where it belongs: each is given gains of its own.

    Args:
        fitter: with the training data; its gains are frozen anew.
        search: a finished one.
        found: the round in which the effect was named.

    """
    final, named = search.final, found.trials[0].score.coordinate.name
    assert final is not None
    near: list[tuple[float, str, StandIn]] = []
    for rival in _candidates(fitter, search, found):
        part, at = _explained(fitter, final, named, rival)
        # of the effect that acts, a law of another form tells that much
        if part > GREATER_PART:
            near.append((-part, rival[0][-1].name, (rival[0], at)))
    fitter.freeze(final.coordinates, final.at)
    return {name: stands for _, name, stands in sorted(near, key=lambda n: n[0])}


def _candidates(fitter: Fitter, search: Search, found: Round) -> list[StandIn]:
    """Return the likeliest rivals at the same place, and effects that bring states along there."""
    best, *others = found.trials
    known = {best.score.coordinate.name, *(c.name for c in search.effects)}
    parts = {t.score.coordinate.name: t.evidence.delta_chi2 / best.evidence.delta_chi2
             for t in others}  # fmt: skip
    likely, moving = [], []
    for score in found.scores:
        knob = score.coordinate
        if knob.name in known or knob.place != best.score.coordinate.place:
            continue
        part = parts.get(knob.name, score.statistic / max(best.score.statistic, 1e-9))
        if part > GREATER_PART:
            likely.append((-part, knob.name, _start(fitter, found, score)))
        elif _brings_states(knob) and knob.stage == best.score.coordinate.stage:
            moving.append(_usual(fitter, score))
    return [stands for _, _, stands in sorted(likely, key=lambda n: n[:2])[:TRIED]] + moving


def _brings_states(knob: Coordinate) -> bool:
    return knob.effect is not None and not knob.channel and bool(knob.effect.states)


def _start(fitter: Fitter, found: Round, score: Score) -> StandIn:
    """Return where a rival begins: where a refit of it ended, or where its linearisation leads."""
    if any(t.score.coordinate.name == score.coordinate.name for t in found.trials):
        return weighed(found, score.coordinate.name)
    shapes = fitter.predictor.model.shapes(score.coordinate)
    return [*shapes, score.coordinate], np.append(np.zeros(len(shapes)), score.estimate)


def _usual(fitter: Fitter, score: Score) -> StandIn:
    """Return a rival at its usual size: the linearisation of one with states says nothing."""
    knob = score.coordinate
    shapes = fitter.predictor.model.shapes(knob)
    usual = float(np.copysign(1.0, score.estimate)) if knob.bounds[0] < 0.0 else 1.0
    return [*shapes, knob], np.append(np.zeros(len(shapes)), usual)


def _explained(fitter: Fitter, final: Fit, named: str, rival: StandIn) -> tuple[float, Array]:
    """Return how much a rival explains over what the named effect does, and where it ends."""
    stays = [i for i, c in enumerate(final.coordinates) if not c.belongs_to(named)]
    rest = [final.coordinates[i] for i in stays]
    free, at = [*rest, *rival[0]], np.concatenate([final.at[stays], rival[1]])
    for _ in range(PASSES):
        fitter.freeze(free, at)
        stands_in = fitter.fit(free, at, STAND_IN_ITERATIONS)
        at = stands_in.at
    right = fitter.fit(final.coordinates, final.at, STAND_IN_ITERATIONS)
    without = fitter.fit(rest, right.at[stays], STAND_IN_ITERATIONS)
    most = without.chi2 - right.chi2
    part = (without.chi2 - stands_in.chi2) / most if most > 0.0 else 0.0
    return part, at[len(rest) :]
