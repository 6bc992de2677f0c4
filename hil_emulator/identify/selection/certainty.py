"""Backward tests of named effects, and the uncertainty of their values.

An effect that was named early may be superfluous with the effects that were named later. An effect
that explains less than `NOTICEABLE` of the variance is kept only if no alternative explanation
remains, since every machine has small effects such as friction ripple along the stroke.
"""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import stdtr, stdtrit

from hil_emulator.identify.estimation.experiment_estimates import EstimatesByExperiment
from hil_emulator.identify.estimation.fit import TOLERATED, Fit, prior_rows
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.estimation.reported_model import ReportedModel
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.free_terms.free_shapes import HATS
from hil_emulator.identify.prediction.free_terms.term_matching import calibrates
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.levels import (
    FALSE_ALARM,
    GREATER_PART,
    LAW_TOLERANCE,
    NOTICEABLE,
    SIGNIFICANCE,
    chi2_threshold,
)
from hil_emulator.identify.selection.progress import Round, Search


def drop_superfluous(fitter: Fitter, search: Search, report: Callable[[str], None]) -> None:
    """Drop an earlier effect that is not significant with the last one in the model.

    Args:
        fitter: with the training data; its filter gains are recomputed.
        search: with an effect just added to the model.
        report: receives progress as text.

    """
    if len(search.effects) < 2:
        return
    full = search.continue_from(converge(fitter, search.free, search.at, search.effects, 1))
    for name in [c.name for c in search.effects[:-1]]:
        kept = {c.name for c in search.without(name)}
        stay = [i for i, c in enumerate(full.coordinates) if c.name in kept]
        rest = [full.coordinates[i] for i in stay]
        fit = fitter.fit(rest, full.at[stay], 2, jacobian=full.jacobian[:, stay])
        widened = fitter.clusters.variance_factor(fit.residual - full.residual, full.residual)
        if fit.chi2 - full.chi2 < search.rounds[-1].needed * widened:
            search.remove(name, "named, later superfluous")
            search.adopt(fit)
            report(f"{name} is no longer needed")
            return


def negligible_likelihood_gain(search: Search, base: Fit) -> bool:
    """Return whether the last effect reduces the deviance far less than an earlier one did.

    Each model is evaluated with filter gains of its own. With the gains of the model before, which
    absorb a part of the misfit, the reduction may appear far larger.

    Args:
        search: with the effect in the model.
        base: the fit with it.

    """
    last = search.rounds[-1] if search.rounds else None
    names = {c.name for c in base.coordinates}
    if last is None or not last.accepted or search.dropped:
        return False
    bases = [*(r.base for r in search.rounds if r.accepted), base]
    falls = [one.deviance - other.deviance for one, other in itertools.pairwise(bases)]
    earlier = {c.name for one in bases for c in one.coordinates}
    return len(falls) > 1 and earlier <= names and falls[-1] < LAW_TOLERANCE * max(falls[:-1])


def loss_without(fitter: Fitter, search: Search, fit: Fit, name: str) -> float:
    """Return the increase in chi-square if one effect is removed and the rest is refitted."""
    kept = {c.name for c in search.without(name)}
    stay = [i for i, c in enumerate(fit.coordinates) if c.name in kept]
    rest = [fit.coordinates[i] for i in stay]
    without = fitter.fit(rest, fit.at[stay], 3, jacobian=fit.jacobian[:, stay])
    return without.chi2 - fit.chi2


def weak_effects(search: Search) -> list[str]:
    """Return the effects with a gain below `NOTICEABLE` that have an alternative explanation.

    One of these conditions is enough:

    1. The law of the effect does not fit.
    2. The effect at its typical size would not be significant in these data.
    3. A rejected candidate of its round gained far more.
    4. A free term still explains more.
    5. Ordinary parameters are highly implausible.
    6. Its value is not significant with all contributions to its uncertainty.

    Args:
        search: finished, with the lack of fit of the named laws.

    """
    last = search.rounds[-1].base
    implausible = bool(highly_implausible_parameters(last))
    return [c.name for c in search.effects
            if (named := search.selected_in(c.name)).best < NOTICEABLE * _total(named, last)
            and (c.name in search.law_mismatch or not named.trials[0].score.visible
                 or _weaker_than_rejected(named) or _weaker_than_free_term(search, named)
                 or implausible or _insignificant(search, named, c.name))]  # fmt: skip


def _total(named: Round, last: Fit) -> float:
    """Return the chi-square to which the gain of a round is compared.

    Estimated noise differs between rounds, so that the round's own chi-square is used.
    """
    return last.sample_size if last.effective is None else named.base.chi2


def total_deviation(search: Search, fit: Fit, name: str) -> float:
    """Return the standard deviation of an effect's coordinate, with its systematic part.

    Args:
        search: with the effect in the model.
        fit: of the model.
        name: of the effect.

    """
    statistical, systematic, _ = _deviations(search, fit, name)
    return math.hypot(statistical, systematic)


def interval(search: Search, fit: Fit, name: str) -> tuple[float, float]:
    """Return the 95 % interval of an effect's coordinate, given the presence of the effect.

    The distribution is Student's, truncated at zero since the sign has passed a test. The
    systematic variance is estimated from few values; the degrees of freedom are those of its sum
    with the statistical variance (Welch and Satterthwaite).
    """
    at = float(fit.at[[c.name for c in fit.coordinates].index(name)])
    statistical, systematic, freedom = _deviations(search, fit, name)
    spread = math.hypot(statistical, systematic)
    share = systematic**2 / (statistical**2 + systematic**2)
    # with millions of degrees of freedom the distribution is normal
    degrees = freedom / max(share, 1e-3) ** 2
    beyond_zero = float(stdtr(degrees, -abs(at) / spread))
    ends = [abs(at) + spread * float(stdtrit(degrees, beyond_zero + (1.0 - beyond_zero) * part))
            for part in (0.025, 0.975)]  # fmt: skip
    low, high = sorted(math.copysign(end, at) for end in ends)
    return low, high


def _deviations(search: Search, fit: Fit, name: str) -> tuple[float, float, int]:
    """Return the statistical and systematic standard deviation of an effect's coordinate.

    The systematic part is due to a wrong law, whose estimate depends on the motion. It is the
    larger one of two: the root of the law's lack of fit times the value, and the spread of the
    experiments' estimates. The third number is its degrees of freedom.
    """
    i = [c.name for c in fit.coordinates].index(name)
    systematic = math.sqrt(search.lack_of_fit.get(name, 0.0)) * abs(float(fit.at[i]))
    freedom = HATS - 1
    if search.reported_model is None:
        spread = float(np.sqrt(fit.covariance()[i, i]))
        # noise that was estimated before the effect was named includes the effect
        named = search.selected_in(name).trials[0].deviation if fit.effective is None else 0.0
        spread = max(spread, named)
    else:
        estimates = search.reported_model.estimates[name]
        spread = search.reported_model.deviations[name]
        if estimates.of_new_experiment > systematic:
            systematic, freedom = estimates.of_new_experiment, len(estimates.values) - 1
    statistical = math.hypot(spread, discrepancy_uncertainty(search, fit)[i])
    return math.hypot(statistical, _confounding(search, fit, i)), systematic, freedom


def _confounding(search: Search, fit: Fit, i: int) -> float:
    """Return the shift of a coordinate by confounding with ordinary parameters, if it is possible.

    With a correct law and plausible parameters the data separate them, and the shift is zero.
    """
    possible = fit.coordinates[i].name in search.law_mismatch or implausible_parameters(fit)
    return nuisance_confounding(fit, i) if possible else 0.0


def nuisance_confounding(fit: Fit, i: int) -> float:
    """Return the shift of a coordinate if outlying ordinary parameters had their configured values.

    Parameters more than `TOLERATED` prior standard deviations off count as outlying: a valve that
    is fitted too slow, for instance, may explain a part of a dead time.
    """
    far = [j for j, c in enumerate(fit.coordinates)
           if np.isfinite(c.prior) and abs(fit.at[j]) > TOLERATED * c.prior]  # fmt: skip
    spread = fit.covariance()
    # outlying parameters may be collinear
    back = np.linalg.pinv(spread[np.ix_(far, far)], hermitian=True) @ fit.at[far]
    return abs(float(spread[i, far] @ back))


def confounding_notes(search: Search, fit: Fit) -> list[str]:
    """Return a note on effects whose uncertainty is mostly due to implausible parameters.

    Args:
        search: with the effects in the model.
        fit: of the model.

    """
    names, far = [c.name for c in fit.coordinates], implausible_parameters(fit)
    wide = [c.name for c in search.effects
            if 2.0 * _confounding(search, fit, names.index(c.name)) ** 2
            > total_deviation(search, fit, c.name) ** 2]  # fmt: skip
    if not far or not wide:
        return []
    part = f"this may explain a part of {' and of '.join(wide)}"
    return [f"{' and '.join(far)}: {part}, and the interval includes that"]


def heterogeneous_estimates(
    effects: Sequence[Coordinate], model: ReportedModel | None
) -> dict[str, str]:
    """Return, by name, effects whose estimates differ between experiments, with the range in words.

    The differences are significant, and larger than those of an approximate law.
    """
    if model is None:
        return {}
    estimates = {c.name: model.estimates[c.name] for c in effects}
    return {name: _range(each) for name, each in estimates.items()
            if each.reported and each.p_value < FALSE_ALARM
            and each.between_experiments**2 > LAW_TOLERANCE * each.reported**2}  # fmt: skip


def _range(estimates: EstimatesByExperiment) -> str:
    """Return the range of the experiments' estimates, without those of large variance."""
    ratios = [value / estimates.reported for value in estimates.values]
    variances = [variance / estimates.reported**2 for variance in estimates.variances]
    parts = [r for r, v in zip(ratios, variances, strict=True) if v < 1.0] or ratios
    low, high = 100.0 * min(parts), 100.0 * max(parts)
    return f"single experiments give {low:.0f} to {high:.0f} % of this value"


def discrepancy_uncertainty(search: Search, fit: Fit) -> Array:
    """Return the standard deviation of each coordinate due to unexplained terms of unknown shape.

    Friction ripple along the stroke, for instance, is partly fitted by other coordinates. Not
    counted are terms of a sensor's calibration curve for errors of that sensor, whose law they
    belong to, and ripple that was integrated out. Estimated noise includes all terms already.
    """
    if fit.effective is not None:
        return np.zeros(len(fit.coordinates))
    last = search.rounds[-1]
    terms = last.terms if search.reported_model is None else search.reported_model.terms
    names = [c.name for c in last.base.coordinates]
    by_term = [(t, dict(zip(names, t.uncertainty, strict=True)))
               for t in terms if len(t.uncertainty)]  # fmt: skip
    return np.array([
        np.linalg.norm([d.get(c.name, 0.0) for t, d in by_term if not calibrates(t, c)])
        for c in fit.coordinates
    ])  # fmt: skip


def _weaker_than_rejected(named: Round) -> bool:
    """Return whether another candidate of the round gained far more than the named one."""
    gains = [t.evidence.delta_chi2 for t in named.trials if not t.partner]
    return max(gains, default=0.0) > named.best / GREATER_PART


def _weaker_than_free_term(search: Search, named: Round) -> bool:
    """Return whether a free term of the final model gains significantly more than the effect."""
    return any(t.excess > named.best for t in search.rounds[-1].terms)


def _insignificant(search: Search, named: Round, name: str) -> bool:
    """Return whether an effect is not significant with its total standard deviation."""
    fit = search.reported or search.rounds[-1].base
    at = fit.at[[c.name for c in fit.coordinates].index(name)]
    return bool(abs(at) < math.sqrt(named.needed) * total_deviation(search, fit, name))


def implausible_parameters(fit: Fit, chance: float = SIGNIFICANCE) -> list[str]:
    """Return the ordinary parameters that are significantly off their configured values, in words.

    Args:
        fit: of the final model.
        chance: significance level for all parameters together, under their priors.

    """
    return [
        f"{c.name} is {float(c.value(at)) / c.neutral:.2g} times its configured value"
        for c, at in outlying_parameters(fit, chance)
    ]


def outlying_parameters(fit: Fit, chance: float) -> list[tuple[Coordinate, float]]:
    """Return the ordinary parameters that are significantly off, with their coordinates."""
    ordinary = sum(np.isfinite(c.prior) for c in fit.coordinates)
    deviations = math.sqrt(chi2_threshold(chance, int(ordinary)))
    return [
        (c, float(at)) for c, at in zip(fit.coordinates, fit.at, strict=True)
        if np.isfinite(c.prior) and c.neutral and abs(at) > deviations * c.prior
    ]  # fmt: skip


def prior_penalty(fit: Fit) -> float:
    """Return the contribution of the priors to chi-square."""
    return float(np.sum((prior_rows(fit.coordinates) * fit.at) ** 2))


def highly_implausible_parameters(fit: Fit) -> list[str]:
    """Return the parameters that are significantly off at the level `FALSE_ALARM`, in words."""
    return implausible_parameters(fit, FALSE_ALARM)
