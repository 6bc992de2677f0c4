"""Rivals of a named effect: indistinguishable effects, and near rivals of a law that does not fit.

The margin of a refitted rival is the increase in chi-square over the named effect, on training and
held-out data. Without a refit the linear model gives it as D = θ² (G_ii - G_ij²/G_jj), where G
holds the products of the projected columns. An indistinguishable rival is then refitted in the
final model in place of the named effect.

If the law of the named effect does not fit, or if the effect was selected together with one that
was later removed, the best fit need not belong to the acting effect. Effects that explain most of
the same residual in its place are then near rivals.
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
"""Iterations of a refit of the final model with a rival."""

MOST_RIVALS_TRIED = 4
"""Largest number of rivals that are refitted in an effect's place; effects with states of their own
are refitted in addition."""

PASSES = 4
"""Number of times that the filter gains are recomputed during the refit of a near rival."""

RIVAL_PASS_ITERATIONS = 6
"""Iterations of each of these refits."""

MOST_REPORTED = 2
"""Number of rivals from which near rivals are not reported: a longer list is of no use."""


def separability(chosen: Score, rival: Score, size: float) -> float:
    """Return the increase in chi-square if a rival replaces the chosen effect.

    Args:
        chosen: score of the acting effect.
        rival: score of the effect that replaces it.
        size: of the chosen effect, in typical sizes.

    """
    return float(np.sum(_difference(chosen, rival, size) ** 2))


def _difference(chosen: Score, rival: Score, size: float) -> Array:
    """Return the change of the residual by the chosen effect, with the rival projected out."""
    column = chosen.column.astype(np.float64)
    if rival.information <= 0.0:
        return np.asarray(size * column)
    other = rival.column.astype(np.float64)
    return np.asarray(size * (column - other * (float(column @ other) / rival.information)))


def margin(best: Trial, rival: Trial, clusters: Clusters) -> tuple[float, float]:
    """Return the loss in chi-square of a refitted rival, plain and corrected for correlation.

    The loss is negative if the rival explains more.
    """
    loss = best.evidence.delta_chi2 - rival.evidence.delta_chi2
    held = best.evidence.held_out - rival.evidence.held_out
    if np.isfinite(held):
        loss += held
    difference = np.asarray(rival.fit.residual - best.fit.residual)
    return loss, loss / clusters.variance_factor(difference, best.fit.residual)


def rivals_of(
    best: Trial,
    scores: Sequence[Score],
    trials: Sequence[Trial] = (),
    clusters: Clusters = UNCORRELATED,
    excerpt: Excerpt | None = None,
) -> tuple[list[str], float | None]:
    """Return the effects that are indistinguishable from the best, and the separating size.

    Args:
        best: trial of the named effect.
        scores: of the round in which it was named.
        trials: of that round.
        clusters: groups of residuals that may be correlated.
        excerpt: data of the scores; None for all training data.

    Returns:
        Names, the nearest first; and the size [unit of the effect] at which the data would separate
        it from all rivals, None without a rival.

    """
    chosen, size = _scored_with(scores, best), float(best.fit.at[-1])
    residual, near = best.fit.residual, clusters
    if excerpt is not None:
        residual, near = excerpt.of(residual), excerpt.clusters(clusters)
    explained = best.evidence.delta_chi2 + float(np.nan_to_num(best.evidence.held_out))
    refitted = {t.score.coordinate.name: t for t in trials}
    rivals: list[tuple[float, str]] = []
    worst = 0.0
    for rival in scores:
        name = rival.coordinate.name
        if rival.coordinate is chosen.coordinate:
            continue
        linear = _linear_margin(chosen, size, rival, residual, near)
        if linear[0] > GREATER_PART * best.evidence.delta_chi2:
            # a rival that explains hardly anything is tested like the absence of the effect
            linear = linear[0], max(linear[1], linear[0] / best.evidence.variance_factor)
        realised = margin(best, refitted[name], clusters) if name in refitted else linear
        if _indistinguishable(realised, explained):
            rivals.append((realised[1], name))
        if _indistinguishable(linear, explained) or _indistinguishable(realised, explained):
            worst = max(worst, _separating(chosen, rival))
    names = [name for _, name in sorted(rivals)]
    return names, worst * abs(chosen.coordinate.scale) if size and worst else None


def _indistinguishable(margin: tuple[float, float], explained: float) -> bool:
    """Return whether a margin is insignificant or within the tolerance of a law."""
    loss, robust = margin
    return robust < DISTINGUISHABLE or loss < LAW_TOLERANCE * explained


def confirmed_rivals(
    fitter: Fitter, final: Fit, named: str, rivals: Sequence[RivalStart]
) -> list[str]:
    """Return the rivals that explain as much as a named effect in the final model, in their order.

    Effects that were named later may have contributed to a rival's earlier gain. A rival that
    gains as much with the named effect in the model explains a different residual.

    Args:
        fitter: with the training data; its filter gains are recomputed.
        final: fit of the final model.
        named: effect that the rivals replace.
        rivals: see `rival_start`.

    """
    stays = [i for i, c in enumerate(final.coordinates) if not c.belongs_to(named)]
    rest = [final.coordinates[i] for i in stays]
    fitter.freeze(final.coordinates, final.at)
    reference = fitter.fit(final.coordinates, final.at, 2)
    without = fitter.fit(rest, reference.at[stays], 2)
    explained = without.chi2 - reference.chi2
    confirmed = []
    for added, start in rivals:
        at = np.concatenate([reference.at[stays], start])
        other = fitter.fit([*rest, *added], at, RIVAL_ITERATIONS)
        difference = other.residual - reference.residual
        widened = fitter.clusters.variance_factor(difference, reference.residual)
        loss = other.chi2 - reference.chi2
        if not _indistinguishable((loss, loss / widened), explained):
            continue
        both = fitter.fit(
            [*final.coordinates, *added], np.concatenate([reference.at, start]), RIVAL_ITERATIONS
        )  # fmt: skip
        if reference.chi2 - both.chi2 < GREATER_PART * (without.chi2 - other.chi2):
            confirmed.append(added[-1].name)
    return confirmed


def rival_start(named: Round, name: str) -> RivalStart:
    """Return the coordinates that a candidate of a round adds, and their best known values."""
    if name in named.near_rivals:
        return named.near_rivals[name]
    for trial in named.trials:
        if trial.score.coordinate.name == name:
            added = [i for i, c in enumerate(trial.fit.coordinates) if c.belongs_to(name)]
            return [trial.fit.coordinates[i] for i in added], trial.fit.at[added]
    score = next(s for s in named.scores if s.coordinate.name == name)
    return [score.coordinate], np.array([score.estimate])


def _scored_with(scores: Sequence[Score], best: Trial) -> Score:
    """Return the best candidate's score, with the column of the data of the other scores."""
    same = (s for s in scores if s.coordinate is best.score.coordinate)
    scored = next(same, best.score)
    return replace(best.score, column=scored.column, information=scored.information)


def _linear_margin(
    chosen: Score, size: float, rival: Score, residual: Array, clusters: Clusters
) -> tuple[float, float]:
    """Return the expected margin of the linear model, or the scores' difference if larger."""
    difference = _difference(chosen, rival, size)
    widened = clusters.variance_factor(difference[: len(residual)], residual)
    loss = max(float(np.sum(difference**2)), chosen.statistic - rival.statistic)
    return loss, loss / widened


def _separating(chosen: Score, rival: Score) -> float:
    """Return the size at which two effects would separate, in typical sizes; 0 if they never do."""
    share = separability(chosen, rival, 1.0)
    return (
        float(np.sqrt(DISTINGUISHABLE / share))
        if share > LAW_TOLERANCE * chosen.information
        else 0.0
    )


def near_rivals(fitter: Fitter, search: Search, selected: Round) -> dict[str, RivalStart]:
    """Return the rivals that explain most of the same residual in an effect's place, best first.

    Each rival is refitted with filter gains of its own, which also correct the rival's states.

    Args:
        fitter: with the training data; its filter gains are recomputed.
        search: finished.
        selected: round in which the effect was named.

    """
    final, named = search.final, selected.trials[0].score.coordinate.name
    assert final is not None
    near: list[tuple[float, str, RivalStart]] = []
    for rival in _candidates(fitter, search, selected):
        part, at = _explained(fitter, final, named, rival)
        # even with a law of another form, the acting effect explains most of the residual
        if part > GREATER_PART:
            near.append((-part, rival[0][-1].name, (rival[0], at)))
    fitter.freeze(final.coordinates, final.at)
    return {name: start for _, name, start in sorted(near, key=lambda n: n[0])}


def _candidates(fitter: Fitter, search: Search, selected: Round) -> list[RivalStart]:
    """Return the likeliest rivals at the same place, and effects with states in the same stage."""
    best, *others = selected.trials
    in_model = {best.score.coordinate.name, *(c.name for c in search.effects)}
    parts = {t.score.coordinate.name: t.evidence.delta_chi2 / best.evidence.delta_chi2
             for t in others}  # fmt: skip
    likely, dynamic = [], []
    for score in selected.scores:
        knob = score.coordinate
        if knob.name in in_model or knob.place != best.score.coordinate.place:
            continue
        part = parts.get(knob.name, score.statistic / max(best.score.statistic, 1e-9))
        if part > GREATER_PART:
            likely.append((-part, knob.name, _start(fitter, selected, score)))
        elif _has_states(knob) and knob.stage == best.score.coordinate.stage:
            dynamic.append(_usual(fitter, score))
    likeliest = sorted(likely, key=lambda n: n[:2])[:MOST_RIVALS_TRIED]
    return [start for _, _, start in likeliest] + dynamic


def _has_states(knob: Coordinate) -> bool:
    return knob.effect is not None and not knob.channel and bool(knob.effect.states)


def _start(fitter: Fitter, selected: Round, score: Score) -> RivalStart:
    """Return the starting values of a rival: those of its refit, or of the linear estimate."""
    if any(t.score.coordinate.name == score.coordinate.name for t in selected.trials):
        return rival_start(selected, score.coordinate.name)
    shapes = fitter.predictor.model.shapes(score.coordinate)
    return [*shapes, score.coordinate], np.append(np.zeros(len(shapes)), score.estimate)


def _usual(fitter: Fitter, score: Score) -> RivalStart:
    """Return a rival with states at its typical size, since its linear estimate is useless."""
    knob = score.coordinate
    shapes = fitter.predictor.model.shapes(knob)
    usual = float(np.copysign(1.0, score.estimate)) if knob.bounds[0] < 0.0 else 1.0
    return [*shapes, knob], np.append(np.zeros(len(shapes)), usual)


def _explained(fitter: Fitter, final: Fit, named: str, rival: RivalStart) -> tuple[float, Array]:
    """Return the gain of a rival over that of the named effect, and its refitted coordinates."""
    stays = [i for i, c in enumerate(final.coordinates) if not c.belongs_to(named)]
    rest = [final.coordinates[i] for i in stays]
    free, at = [*rest, *rival[0]], np.concatenate([final.at[stays], rival[1]])
    for _ in range(PASSES):
        fitter.freeze(free, at)
        replaced = fitter.fit(free, at, RIVAL_PASS_ITERATIONS)
        at = replaced.at
    reference = fitter.fit(final.coordinates, final.at, RIVAL_PASS_ITERATIONS)
    without = fitter.fit(rest, reference.at[stays], RIVAL_PASS_ITERATIONS)
    # with the rival's filter gains the named effect may explain nothing
    most = max(without.chi2 - reference.chi2, LEAST_GAIN)
    part = (without.chi2 - replaced.chi2) / most
    return part, at[len(rest) :]
