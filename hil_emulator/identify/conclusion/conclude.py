"""Conversion of a finished search to its result."""

import math
from collections.abc import Mapping

import numpy as np

from hil_emulator.config.datasheet import SheetQuantity
from hil_emulator.identify.conclusion import account, wrong_values
from hil_emulator.identify.conclusion.findings import (
    ExperimentEstimate,
    Finding,
    Refitted,
    Rival,
    Unexplained,
    in_words,
    shown_unit,
)
from hil_emulator.identify.conclusion.other_forms import other_forms
from hil_emulator.identify.conclusion.result import Result
from hil_emulator.identify.conclusion.wrong_values import FarOff
from hil_emulator.identify.disagreement.repeatability import Repeatability
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.experiment_design.contrast import contrast, variation
from hil_emulator.identify.experiment_design.next_experiment import recommend
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.certainty import (
    confounding_notes,
    discrepancy_uncertainty,
    highly_implausible_parameters,
    interval,
    outlying_parameters,
)
from hil_emulator.identify.selection.evidence import Trial
from hil_emulator.identify.selection.levels import FALSE_ALARM, NORMAL_95, SIGNIFICANCE
from hil_emulator.identify.selection.progress import Search
from hil_emulator.identify.selection.rivals import (
    MOST_REPORTED,
    confirmed_rivals,
    near_rivals,
    rival_start,
)
from hil_emulator.identify.selection.search import Searcher

LONGEST = 80
"""Largest number of characters of a clause of the headline (assumed)."""

OUTSIDE_THE_CATALOGUE = ("an effect that is not in the catalogue", "an error of the sensor")
"""Explanations of a residual for which no candidate is visible."""


def conclude(searcher: Searcher, search: Search, thorough: bool = True) -> Result:
    """Turn a search into a result.

    Args:
        searcher: with data and predictor.
        search: finished, or interrupted.
        thorough: False omits slow parts: rivals of laws that do not fit, and the forecast of the
            next experiment.

    """
    if thorough:
        _find_near_rivals(searcher, search)
    findings = [_finding(searcher, search, c) for c in search.effects]
    parts = account.shares(searcher, search)
    findings = [_with_share(f, parts.get(f.name, 0.0)) for f in findings]
    unknown = [
        Unexplained(
            t.balance.name, t.regressor, t.balance.unit, tuple(t.knots.tolist()),
            tuple(t.curve.tolist()), in_words(t.regressor, t.knots, t.curve, t.balance.unit),
            t.statistic,
        )
        for t in search.unexplained
    ]  # fmt: skip
    first = search.rounds[0]
    unseen = [s.coordinate.name for s in first.scores
              if not s.visible and s.statistic < first.needed]  # fmt: skip
    parameters = _refitted(search, searcher.fitter.predictor.model.config.sheet)
    result = Result("nothing_missing", _explained(search, parameters))
    result.nearest, result.parameters = search.nearest, parameters
    result.effects, result.unknown, result.search = findings, unknown, search
    result.unseen = [n for n in unseen if n not in {f.name for f in findings}]
    if findings:
        result.verdict = "missing_effects"
        result.reason = "missing: " + "; ".join(str(f) for f in findings)
        result.implausible = highly_implausible_parameters(_last_fit(search))
        result.notes += confounding_notes(search, _last_fit(search))
    elif unknown:
        result.verdict = "unknown_effect"
        u = unknown[0]
        result.reason = f"something acts on the {u.balance}, depending on {u.regressor}: {u.shape}"
        result.reason += _nearest(search)
    # a default that no file states is not a wrong value; `_explained` names it
    elif far := [f for f in outlying_parameters(_last_fit(search), FALSE_ALARM) if f[0].stated]:
        _conclude_values(result, search, far)
    ambiguous = [f for f in findings if f.group]
    if ambiguous:
        f = ambiguous[0]
        if thorough:
            result.plan = recommend(searcher, search, f.name, f.group, searcher.report)
        result.next_experiment = str(result.plan or "") or _advice(searcher, f)
    result.notes += other_forms(_last_fit(search))
    _measure(searcher, search, result)
    searcher.fitter.release()
    return result


def _advice(searcher: Searcher, finding: Finding) -> str:
    """Return what to vary if no experiment can be forecast."""
    declared = {c.name: c.effect for c in searcher.candidates}
    one, *others = (declared.get(name) for name in (finding.name, *finding.group))
    advice = f"{finding.name} and {', '.join(finding.group)} look alike here; record"
    if one is None:
        return f"{advice} with larger and smaller motions"
    return f"{advice} {contrast(one, [other for other in others if other is not None])}"


def _conclude_values(result: Result, search: Search, far: FarOff) -> None:
    """Report values that differ from the configuration, or their rival explanations."""
    values = wrong_values.in_words(far, result.parameters) or highly_implausible_parameters(
        _last_fit(search)
    )
    result.implausible = highly_implausible_parameters(_last_fit(search))
    if rivals := wrong_values.instead(search, far):
        result.verdict = "cannot_tell"
        names = wrong_values.names(far, result.parameters)
        result.reason = wrong_values.competing(values, names, rivals)
        result.next_experiment = wrong_values.separating(names, rivals)
        return
    result.verdict = "wrong_value"
    result.reason = f"the data are explained, with another value: {'; '.join(values)}"


def _explained(search: Search, parameters: Mapping[str, Refitted]) -> str:
    """Return the sentence that nothing is missing, with implausible parameters."""
    reason = "the model explains the data within their noise"
    far = wrong_values.in_words(outlying_parameters(_last_fit(search), SIGNIFICANCE), parameters)
    if not far:
        return reason
    return f"{reason} if {' and '.join(far)}: check that before you trust it"


def _nearest(search: Search) -> str:
    return f"; nearest in the catalogue: {search.nearest}" if search.nearest else ""


def _last_fit(search: Search) -> Fit:
    return search.reported or search.rounds[-1].base


def _refitted(search: Search, sheet: Mapping[str, SheetQuantity]) -> dict[str, Refitted]:
    """Return the ordinary parameters, by name."""
    final = search.reported
    if final is None:
        return {}
    deviation = np.sqrt(np.diag(final.covariance()))
    if search.reported_model is not None:
        deviation = np.array([search.reported_model.deviation(c.name) for c in final.coordinates])
    deviations = np.hypot(deviation, discrepancy_uncertainty(search, final))
    return {
        c.name: Refitted(
            c.neutral, float(c.value(float(a))), float(c.value(float(a - NORMAL_95 * d))),
            float(c.value(float(a + NORMAL_95 * d))), c.unit, shown_unit(c), sheet.get(c.field),
        )
        for c, a, d in zip(search.ordinary, final.at, deviations, strict=False)
    }  # fmt: skip


def _measure(searcher: Searcher, search: Search, result: Result) -> None:
    """Fill gap, ladder and traces."""
    if search.reported is None:
        return
    account.fill(searcher, search, result)
    if result.verdict == "nothing_missing" and result.repeats and result.repeats.unexplained:
        conclude_repeated(result, result.repeats, search)
    for searched in search.rounds:
        if searched.accepted:
            t = searched.trials[0]
            result.ladder.append(
                {
                    "effect": t.score.coordinate.name,
                    "beside": t.partner,
                    "training": t.evidence.delta_chi2,
                    "validation": _or_none(t.evidence.held_out),
                }
            )


def conclude_repeated(result: Result, repeats: Repeatability, search: Search) -> None:
    """Report a residual that recurs, its likeliest explanations, and how to separate them."""
    result.verdict, result.reason = "cannot_tell", str(repeats)
    last = search.rounds[-1]
    scores = [t.score for t in last.trials] + [s for s in last.scores if s.visible]
    candidates = {s.coordinate.name: s.coordinate.effect for s in scores}
    one, other = [*candidates, *OUTSIDE_THE_CATALOGUE][:2]
    effects = [e for name in (one, other) if (e := candidates.get(name)) is not None]
    ways = contrast(effects[0], effects[1:]) if len(effects) > 1 else variation(effects)
    if not effects:
        ways = f"the {repeats.channel.replace('_', ' ')} with a second sensor as well"
    result.reason += (
        "; no effect of the catalogue explains it with certainty: the likeliest explanations are "
        f"{one} and {other}"
    )
    result.next_experiment = f"to separate {one} from {other}, record {ways}"


def _find_near_rivals(searcher: Searcher, search: Search) -> None:
    """Search near rivals of laws that do not fit, or that replaced a dropped effect."""
    after_dropped = False
    for searched in (r for r in search.rounds if r.accepted):
        named = searched.trials[0].score.coordinate
        if named not in search.effects:
            after_dropped = True
        elif after_dropped or named.name in search.law_mismatch:
            searcher.report(f"looking for near rivals of {named.name}")
            searched.near_rivals |= near_rivals(searcher.fitter, search, searched)


def _finding(searcher: Searcher, search: Search, coordinate: Coordinate) -> Finding:
    round_ = search.selected_in(coordinate.name)
    best = round_.trials[0]
    final, reported = search.final, search.reported
    assert final is not None
    assert reported is not None
    at = float(reported.at[[c.name for c in reported.coordinates].index(coordinate.name)])
    ends = sorted(coordinate.value(end) for end in interval(search, reported, coordinate.name))
    alike = [rival_start(round_, name) for name in round_.indistinguishable]
    group = confirmed_rivals(searcher.fitter, final, coordinate.name, alike) if alike else []
    completed = (
        [search.completions[coordinate.name].rival] if coordinate.name in search.completions else []
    )
    group = list(dict.fromkeys([*group, *completed]))
    group += [name for name in round_.near_rivals if name not in group][
        : max(0, MOST_REPORTED - len(group))
    ]
    weaker = [t for t in round_.trials[1:] if t.score.coordinate.name not in group]
    return Finding(
        name=coordinate.name,
        knob=coordinate.effect.knob.name if coordinate.effect else coordinate.name,
        value=float(coordinate.value(at)), unit=coordinate.unit, shown=shown_unit(coordinate),
        interval=(float(ends[0]), float(ends[1])), explained=0.0,
        delta_chi2=best.evidence.delta_chi2, held_out=_or_none(best.evidence.held_out),
        group=tuple(group),
        form_differs=coordinate.name in search.law_mismatch,
        form=search.law_mismatch.get(coordinate.name, ""),
        rivals=tuple(_rival(t, best) for t in weaker), separating_size=round_.separating_size,
        words=_in_words(coordinate), by_experiment=_estimates(search, coordinate.name),
    )  # fmt: skip


def _estimates(search: Search, name: str) -> tuple[ExperimentEstimate, ...]:
    """Return each experiment's estimate of an effect, if there are any."""
    if search.reported_model is None or not search.reported_model.estimates[name].reported:
        return ()
    estimates = search.reported_model.estimates[name]
    reported = estimates.reported
    each = zip(estimates.names, estimates.values, estimates.variances, strict=True)
    return tuple(
        ExperimentEstimate(e, v / reported, math.sqrt(s) / abs(reported)) for e, v, s in each
    )


def _in_words(coordinate: Coordinate) -> str:
    """Return the effect in words, with its sensor."""
    named = coordinate.name.rpartition(".")[2].replace("_", " ")
    words = coordinate.effect.words if coordinate.effect else ""
    words = words if 0 < len(words) <= LONGEST else named
    return f"{words} ({coordinate.channel.replace('_', ' ')})" if coordinate.channel else words


def _rival(trial: Trial, best: Trial) -> Rival:
    reasons = trial.evidence.objections or [
        f"gains {trial.evidence.delta_chi2:.0f}, "
        f"{best.score.coordinate.name} {best.evidence.delta_chi2:.0f}"
        + (f" together with {best.partner}" if best.partner else "")
    ]
    return Rival(
        trial.score.coordinate.name, trial.evidence.delta_chi2, _or_none(trial.evidence.held_out),
        "; ".join(reasons),
    )  # fmt: skip


def _with_share(finding: Finding, share: float) -> Finding:
    return Finding(**{**vars(finding), "explained": share})


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None
