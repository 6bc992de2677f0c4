"""Rivals of a named effect: which these data cannot tell from it, and which nearly stand for it.

Where a rival was refitted together with everything else, the realised margin decides: by how much
its chi-square is larger than that of the named effect, on training and held-out data. Elsewhere the
linearised data decide, by D = θ² (G_ii - G_ij²/G_jj) with the projected columns' products G. What
looks alike so far is then put into the finished model in the named effect's place, and refitted.

By how much a law misses that of the machine depends on its shape: of two that both miss it, the one
that explains more need not be that of the effect that acts. The same holds where an effect was
chosen beside another one that was since taken out of the model. There, who explains much of it in
its place is a rival, too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.estimation.clusters import UNCORRELATED, Clusters
from hil_emulator.identify.estimation.excerpt import Excerpt
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.map_fit import LEAST_GAIN, Fitter
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.evidence import Trial
from hil_emulator.identify.selection.levels import DISTINGUISHABLE, GREATER_PART, LAW_TOLERANCE
from hil_emulator.identify.selection.progress import RivalStart, Round, Search
from hil_emulator.identify.selection.scan import Score

RIVAL_ITERATIONS = 4
"""Iterations of a refit of the finished model with a rival in it."""

MOST_RIVALS_TRIED = 4
"""Rivals that are tried in an effect's place, the likeliest first; those that bring states along
come on top."""

PASSES = 4
"""Times that the gains are computed anew on the way of a rival."""

RIVAL_PASS_ITERATIONS = 6
"""Iterations of a refit in between."""

MOST_REPORTED = 2
"""Rivals beside which those that explain much of it are not told: a longer list names nothing."""


def separability(chosen: Score, rival: Score, size: float) -> float:
    """Return by how much chi-square grows if the rival takes the place of the chosen effect.

    Args:
        chosen: the effect that is there.
        rival: what would take its place.
        size: of the chosen effect, in typical sizes.

    """
    return float(np.sum(_difference(chosen, rival, size) ** 2))


def _difference(chosen: Score, rival: Score, size: float) -> Array:
    """Return what of the chosen effect's sensitivity the best size of the rival leaves."""
    mine = chosen.column.astype(np.float64)
    if rival.information <= 0.0:
        return np.asarray(size * mine)
    other = rival.column.astype(np.float64)
    return np.asarray(size * (mine - other * (float(mine @ other) / rival.information)))


def margin(best: Trial, rival: Trial, clusters: Clusters) -> tuple[float, float]:
    """Return by how much a refitted rival explains less, and what serial correlation makes of it.

    Both in chi-square; negative where the rival explains more.
    """
    lost = best.evidence.delta_chi2 - rival.evidence.delta_chi2
    held = best.evidence.held_out - rival.evidence.held_out
    if np.isfinite(held):
        lost += held
    apart = np.asarray(rival.fit.residual - best.fit.residual)
    return lost, lost / clusters.variance_factor(apart, best.fit.residual)


def rivals_of(
    best: Trial,
    scores: Sequence[Score],
    trials: Sequence[Trial] = (),
    clusters: Clusters = UNCORRELATED,
    excerpt: Excerpt | None = None,
) -> tuple[list[str], float | None]:
    """Return the effects that cannot be told from the best, and the size that would separate.

    Args:
        best: the named effect.
        scores: the round in which it was named.
        trials: the candidates of that round that were refitted.
        clusters: residuals that may be correlated.
        excerpt: where the scores were taken; None for all data.

    Returns:
        Names, the nearest first; and the size [unit of the effect] at which the nearest of all
        rivals would separate, None without one.

    """
    chosen, size = _scored_with(scores, best), float(best.fit.at[-1])
    residual, near = best.fit.residual, clusters
    if excerpt is not None:
        residual, near = excerpt.of(residual), excerpt.clusters(clusters)
    explained = best.evidence.delta_chi2 + float(np.nan_to_num(best.evidence.held_out))
    refitted = {t.score.coordinate.name: t for t in trials}
    found: list[tuple[float, str]] = []
    worst = 0.0
    for rival in scores:
        name = rival.coordinate.name
        if rival.coordinate is chosen.coordinate:
            continue
        linear = _linear_margin(chosen, size, rival, residual, near)
        if linear[0] > GREATER_PART * best.evidence.delta_chi2:
            # who leaves most of it is told from it as nothing would be
            linear = linear[0], max(linear[1], linear[0] / best.evidence.variance_factor)
        apart = margin(best, refitted[name], clusters) if name in refitted else linear
        if _alike(apart, explained):
            found.append((apart[1], name))
        if _alike(linear, explained) or _alike(apart, explained):
            worst = max(worst, _separating(chosen, rival))
    names = [name for _, name in sorted(found)]
    return names, worst * abs(chosen.coordinate.scale) if size and worst else None


def _alike(margin: tuple[float, float], explained: float) -> bool:
    """Tell whether a margin is chance, or no more than an inexact law leaves."""
    lost, certain = margin
    return certain < DISTINGUISHABLE or lost < LAW_TOLERANCE * explained


def confirmed_rivals(
    fitter: Fitter, final: Fit, named: str, rivals: Sequence[RivalStart]
) -> list[str]:
    """Return the rivals that explain as much in the finished model, in their order.

    A rival that was weighed before the other effects were found may have profited from them. One
    that explains as much beside the named effect as in its place explains something else.

    Args:
        fitter: with the training data; its gains are frozen anew.
        final: the finished model.
        named: the effect whose place they take.
        rivals: what they bring along, and where it starts; see `rival_start`.

    """
    stays = [i for i, c in enumerate(final.coordinates) if not c.belongs_to(named)]
    rest = [final.coordinates[i] for i in stays]
    fitter.freeze(final.coordinates, final.at)
    right = fitter.fit(final.coordinates, final.at, 2)
    without = fitter.fit(rest, right.at[stays], 2)
    explained = without.chi2 - right.chi2
    found = []
    for own, start in rivals:
        at = np.concatenate([right.at[stays], start])
        other = fitter.fit([*rest, *own], at, RIVAL_ITERATIONS)
        widened = fitter.clusters.variance_factor(other.residual - right.residual, right.residual)
        lost = other.chi2 - right.chi2
        if not _alike((lost, lost / widened), explained):
            continue
        beside = fitter.fit(
            [*final.coordinates, *own], np.concatenate([right.at, start]), RIVAL_ITERATIONS
        )  # fmt: skip
        if right.chi2 - beside.chi2 < GREATER_PART * (without.chi2 - other.chi2):
            found.append(own[-1].name)
    return found


def rival_start(found: Round, name: str) -> RivalStart:
    """Return what a candidate of a round brings along."""
    if name in found.near_rivals:
        return found.near_rivals[name]
    for trial in found.trials:
        if trial.score.coordinate.name == name:
            own = [i for i, c in enumerate(trial.fit.coordinates) if c.belongs_to(name)]
            return [trial.fit.coordinates[i] for i in own], trial.fit.at[own]
    score = next(s for s in found.scores if s.coordinate.name == name)
    return [score.coordinate], np.array([score.estimate])


def _scored_with(scores: Sequence[Score], best: Trial) -> Score:
    """Return the best candidate's score, with the columns of the data in which all were scored."""
    same = (s for s in scores if s.coordinate is best.score.coordinate)
    known = next(same, best.score)
    return replace(best.score, column=known.column, information=known.information)


def _linear_margin(
    chosen: Score, size: float, rival: Score, residual: Array, clusters: Clusters
) -> tuple[float, float]:
    """Return the margin that the linearised data expect, or have shown where that is larger."""
    difference = _difference(chosen, rival, size)
    widened = clusters.variance_factor(difference[: len(residual)], residual)
    shown = chosen.statistic - rival.statistic
    lost = max(float(np.sum(difference**2)), shown)
    return lost, lost / widened


def _separating(chosen: Score, rival: Score) -> float:
    """Return the size in typical units at which two effects would separate; 0 if at none."""
    share = separability(chosen, rival, 1.0)
    return (
        float(np.sqrt(DISTINGUISHABLE / share))
        if share > LAW_TOLERANCE * chosen.information
        else 0.0
    )


def near_rivals(fitter: Fitter, search: Search, found: Round) -> dict[str, RivalStart]:
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
    near: list[tuple[float, str, RivalStart]] = []
    for rival in _candidates(fitter, search, found):
        part, at = _explained(fitter, final, named, rival)
        # of the effect that acts, a law of another form tells that much
        if part > GREATER_PART:
            near.append((-part, rival[0][-1].name, (rival[0], at)))
    fitter.freeze(final.coordinates, final.at)
    return {name: stands for _, name, stands in sorted(near, key=lambda n: n[0])}


def _candidates(fitter: Fitter, search: Search, found: Round) -> list[RivalStart]:
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
    return [
        stands for _, _, stands in sorted(likely, key=lambda n: n[:2])[:MOST_RIVALS_TRIED]
    ] + moving


def _brings_states(knob: Coordinate) -> bool:
    return knob.effect is not None and not knob.channel and bool(knob.effect.states)


def _start(fitter: Fitter, found: Round, score: Score) -> RivalStart:
    """Return where a rival begins: where a refit of it ended, or where its linearisation leads."""
    if any(t.score.coordinate.name == score.coordinate.name for t in found.trials):
        return rival_start(found, score.coordinate.name)
    shapes = fitter.predictor.model.shapes(score.coordinate)
    return [*shapes, score.coordinate], np.append(np.zeros(len(shapes)), score.estimate)


def _usual(fitter: Fitter, score: Score) -> RivalStart:
    """Return a rival at its usual size: the linearisation of one with states says nothing."""
    knob = score.coordinate
    shapes = fitter.predictor.model.shapes(knob)
    usual = float(np.copysign(1.0, score.estimate)) if knob.bounds[0] < 0.0 else 1.0
    return [*shapes, knob], np.append(np.zeros(len(shapes)), usual)


def _explained(fitter: Fitter, final: Fit, named: str, rival: RivalStart) -> tuple[float, Array]:
    """Return how much a rival explains over what the named effect does, and where it ends."""
    stays = [i for i, c in enumerate(final.coordinates) if not c.belongs_to(named)]
    rest = [final.coordinates[i] for i in stays]
    free, at = [*rest, *rival[0]], np.concatenate([final.at[stays], rival[1]])
    for _ in range(PASSES):
        fitter.freeze(free, at)
        stands_in = fitter.fit(free, at, RIVAL_PASS_ITERATIONS)
        at = stands_in.at
    right = fitter.fit(final.coordinates, final.at, RIVAL_PASS_ITERATIONS)
    without = fitter.fit(rest, right.at[stays], RIVAL_PASS_ITERATIONS)
    # with the rival's gains the named effect may explain nothing: the rival explains far more then
    most = max(without.chi2 - right.chi2, LEAST_GAIN)
    part = (without.chi2 - stands_in.chi2) / most
    return part, at[len(rest) :]
