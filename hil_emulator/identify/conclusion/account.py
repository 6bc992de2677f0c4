"""Gap of a result, its place, and the share of each effect."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.identify.conclusion.effect_table import effect_table
from hil_emulator.identify.conclusion.findings import in_words
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.conclusion.term_places import place_of
from hil_emulator.identify.disagreement.gap import (
    Compared,
    View,
    compare,
    enter,
    measure,
    traces,
    view,
)
from hil_emulator.identify.disagreement.motion import by_motion
from hil_emulator.identify.disagreement.regions import Disagreement, disagreements
from hil_emulator.identify.disagreement.repeatability import repeatability
from hil_emulator.identify.disagreement.residuals import draw, simplest, with_term
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.ordinary_least_squares import ordinary_least_squares
from hil_emulator.identify.prediction.free_terms.regressors import regressors
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.selection.certainty import loss_without
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.search import Searcher

MAPPED = 2
"""Number of balances with a map."""

HYSTERETIC = 0.5
"""Ratio of width and size of a loop from which a term is called hysteretic (assumed)."""


FAILURES = (ArithmeticError, LookupError, ValueError, MemoryError)
"""Errors of numerical work on unforeseen data; the findings are reported in spite of them."""


def fill(searcher: Searcher, search: Search, result: Result) -> None:
    """Fill in gap, regions, maps and traces of a search with at least one round."""
    first, last = search.rounds[0], search.rounds[-1]
    after = search.reported or last.base
    before = first.base if search.effects else after
    predictor = searcher.fitter.predictor
    training = searcher.fitter.experiments
    jobs = searcher.fitter.jobs
    compared = compare(predictor, before, after, training, searcher.validation, jobs)
    result.measure = predictor.measure
    result.gap = measure(predictor, compared)
    result.traces = traces(predictor, compared)
    if isinstance(predictor, Observer):
        result.motion = by_motion(predictor, compared)
    result.where = _where(searcher, first, compared.before["training"])
    result.final_at = after.at
    if after.effective is not None:
        result.repeats = repeatability(predictor, compared.after["training"])
    if result.unknown:
        _describe_unknown(searcher, search, result)
    try:
        _illustrate(searcher, search, compared, result)
    except FAILURES as error:
        result.notes.append(f"regions and maps are incomplete: {type(error).__name__}: {error}")


def _illustrate(searcher: Searcher, search: Search, compared: Compared, result: Result) -> None:
    """Fill in the contents of pictures and tables: remaining disagreement, and maps."""
    first, last = search.rounds[0], search.rounds[-1]
    after = search.reported or last.base
    if last is not first:
        result.remaining = _where(searcher, last, compared.after["training"])
    effects = [c.name for c in search.effects]
    for term in _mapped(first, result.where):
        old = after.without(effects) if effects else with_term(first.columns_fit, term)
        fitter = searcher.fitter
        drawn = draw(fitter.predictor, old, after, term, fitter.experiments, fitter.jobs)
        result.maps.append(drawn)


def _describe_unknown(searcher: Searcher, search: Search, result: Result) -> None:
    """Describe unexplained terms; if no effect was named, make an effect of the strongest term.

    With named effects a term is a misfit of their laws, for which a table is rarely useful.
    """
    predictor, training = searcher.fitter.predictor, searcher.fitter.experiments
    last = search.rounds[-1]
    terms = {(t.balance.name, t.regressor): t for t in search.unexplained}
    for i, unexplained in enumerate(result.unknown):
        term = terms[unexplained.balance, unexplained.regressor]
        curve = simplest(last.base, term)
        shape = in_words(unexplained.regressor, term.knots, curve, unexplained.unit)
        if not term.balance.channel:
            drawn = draw(predictor, with_term(last.base, term), last.base, term, training)
            shape += ", hysteretic" if drawn.loop > HYSTERETIC else ", without hysteresis"
        result.unknown[i] = replace(unexplained, curve=tuple(curve.tolist()), shape=shape)
    placed = [u for u in result.unknown if place_of(u)]
    if placed and result.verdict == "unknown_effect":
        strongest = max(placed, key=lambda u: u.statistic)
        result.added = effect_table(strongest, [e.name for e in predictor.model.effects])
        result.final_at = with_term(last.base, terms[strongest.balance, strongest.regressor]).at


def _where(searcher: Searcher, searched: Round, views: Sequence[View]) -> list[Disagreement]:
    """Return the balances that disagree at the start of a round."""
    predictor = searcher.fitter.predictor
    names, absent = predictor.model.signal_names, predictor.absent
    parts = [
        regressors(v.replay.track.astype(np.float64), names, v.experiment.period, absent=absent)
        for v in views
    ]
    states = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    count = len(searcher.fitter.predictor.channels)
    if searched.rows is not None:
        states = {name: values[searched.rows[::count] // count] for name, values in states.items()}
    return disagreements(searched.columns_fit, searched.noticeable, states, count)


def _mapped(first: Round, where: Sequence[Disagreement]) -> list[DiscrepancyTerm]:
    """Return the terms for maps: those of balances that disagree, or else the strongest ones."""
    terms = {(t.balance.name, t.regressor): t for t in first.terms
             if t.columns.shape[1] and not t.balance.channel}  # fmt: skip
    wanted = [terms[d.balance, d.regressor] for d in where if (d.balance, d.regressor) in terms]
    mapped: list[DiscrepancyTerm] = []
    for term in [*wanted, *terms.values()]:
        if term.balance not in [f.balance for f in mapped]:
            mapped.append(term)
    return mapped[: max(1, min(MAPPED, len(where)))]


def compare_with_plain_fit(searcher: Searcher, search: Search, result: Result) -> None:
    """Enter the gap of ordinary least squares with the same parameters and data."""
    predictor, training = searcher.fitter.predictor, searcher.fitter.experiments
    plain = ordinary_least_squares(predictor, training, search.reported or search.rounds[-1].base)
    result.plain = {
        c.name: float(c.value(float(at))) for c, at in zip(plain.coordinates, plain.at, strict=True)
    }
    for part, experiments in (("training", training), ("validation", searcher.validation)):
        if experiments:
            compared = view(predictor, plain, experiments)
            enter(result.gap, predictor, part, "least_squares", compared)


def shares(searcher: Searcher, search: Search) -> dict[str, float]:
    """Return the share of the squared error that each effect explains.

    The error is that of the configured model, one step ahead, on the training data, with the
    weights of the final model. The remaining share is noise or unexplained.
    """
    if search.final is None or search.reported is None or not search.effects:
        return {}
    fitter = searcher.fitter
    fitter.freeze(search.reported.coordinates, search.reported.at)
    gains = (_losses_without if search.dropped else _gains_when_named)(searcher, search)
    total = _chi2(searcher, search.rounds[0].base)
    return {c.name: max(gains.get(c.name, 0.0), 0.0) / total if total > 0.0 else 0.0
            for c in search.effects}  # fmt: skip


def _gains_when_named(searcher: Searcher, search: Search) -> dict[str, float]:
    """Return the fall of chi-square when each effect was named."""
    assert search.final is not None
    chi2 = [_chi2(searcher, r.base) for r in search.rounds] + [_chi2(searcher, search.final)]
    return {
        r.trials[0].score.coordinate.name: chi2[i] - chi2[i + 1]
        for i, r in enumerate(search.rounds) if r.accepted
    }  # fmt: skip


def _losses_without(searcher: Searcher, search: Search) -> dict[str, float]:
    """Return the rise of chi-square if each effect is removed from the final model."""
    fitter = searcher.fitter
    full = fitter.fit(search.free, search.at, 2)
    return {c.name: loss_without(fitter, search, full, c.name) for c in search.effects}


def _chi2(searcher: Searcher, fit: Fit) -> float:
    residual = searcher.fitter.residual(fit.coordinates, fit.at)
    return float(residual @ residual)


def judge(result: Result) -> None:
    """Set the verdict of `gap`, which does not search."""
    result.added = None
    if result.search is not None and not result.search.rounds[-1].unknown:
        result.where = []
    if result.search is not None and result.search.reported is not None:
        result.final_at = result.search.reported.at
    if not result.where and result.repeats is not None and result.repeats.unexplained:
        result.verdict = "cannot_tell"
        result.reason = f"{result.repeats} (`identify` searches for the effect)"
        return
    if not result.where:
        result.verdict = "agrees"
        result.reason = (
            "no balance disagrees beyond noise and usual disturbances "
            "(no effect was searched for; `identify` does)"
        )
        return
    result.verdict = "disagrees"
    places = "; ".join(str(d) for d in result.where[:2])
    result.reason = f"{places} (`identify` searches for the effect)"
