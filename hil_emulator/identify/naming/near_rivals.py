"""Rivals at the same place that explain nearly as much as an effect whose law does not fit.

By how much a law misses that of the machine depends on its shape. Of two laws that both miss it,
the one that explains a little more need not be that of the effect that acts. The same holds where
an effect was chosen beside another one that was since taken out of the model.
"""

from collections.abc import Iterator

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.naming.completion import RIVALLED, place
from hil_emulator.identify.naming.confusion import belongs, weighed
from hil_emulator.identify.naming.fit import Fit, Fitter
from hil_emulator.identify.naming.hollow import same_part
from hil_emulator.identify.naming.progress import Round, Search, StandIn

PASSES = 4
"""Times that the gains are computed anew on the way of a rival."""

ROUNDS = 6
"""Iterations of a refit in between."""

MOST = 2
"""Rivals of this kind that are told; a longer list names nothing."""


def near_rivals(fitter: Fitter, search: Search, found: Round) -> dict[str, StandIn]:
    """Return the rivals that nearly explain as much in an effect's place, the best first.

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
        if part > RIVALLED:
            near.append((-part, rival[0][-1].name, (rival[0], at)))
    fitter.freeze(final.coordinates, final.at)
    return {name: stands for _, name, stands in sorted(near, key=lambda n: n[0])[:MOST]}


def _candidates(fitter: Fitter, search: Search, found: Round) -> Iterator[StandIn]:
    """Yield near rivals of the round, and effects of the same stage that bring states along."""
    best, *rivals = found.trials
    in_model = {c.name for c in search.effects}
    seen = set(in_model)
    for trial in rivals:
        name = trial.score.coordinate.name
        near = trial.evidence.gain > RIVALLED * best.evidence.gain
        if near and name not in in_model and place(trial) == place(best):
            seen.add(name)
            yield weighed(found, name)
    for score in found.scores:
        knob = score.coordinate
        moves = knob.effect is not None and not knob.channel and bool(knob.effect.states)
        if moves and knob.name not in seen and same_part(knob, best.score.coordinate):
            shapes = fitter.predictor.twin.shapes(knob)
            usual = float(np.copysign(1.0, score.estimate)) if knob.bounds[0] < 0.0 else 1.0
            yield [*shapes, knob], np.append(np.zeros(len(shapes)), usual)


def _explained(fitter: Fitter, final: Fit, named: str, rival: StandIn) -> tuple[float, Array]:
    """Return how much a rival explains over what the named effect does, and where it ends."""
    stays = [i for i, c in enumerate(final.coordinates) if not belongs(c, named)]
    rest = [final.coordinates[i] for i in stays]
    free, at = [*rest, *rival[0]], np.concatenate([final.at[stays], rival[1]])
    for _ in range(PASSES):
        fitter.freeze(free, at)
        stands_in = fitter.fit(free, at, ROUNDS)
        at = stands_in.at
    right = fitter.fit(final.coordinates, final.at, ROUNDS)
    without = fitter.fit(rest, right.at[stays], ROUNDS)
    most = without.chi2 - right.chi2
    part = (without.chi2 - stands_in.chi2) / most if most > 0.0 else 0.0
    return part, at[len(rest) :]
