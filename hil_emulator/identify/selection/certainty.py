"""What is certain of an effect in the model: that it is needed, that it is there, and its value.

The first name goes to what explains the most of everything that is missing; beside the effects that
were found after it, it may explain nothing. Every machine has a little of everything, like friction
that ripples along the stroke: what explains hardly anything is named only where it can be nothing
else.
"""

import itertools
import math
from collections.abc import Callable

import numpy as np
from scipy.special import stdtr, stdtrit

from hil_emulator.identify.estimation.fit import TOLERATED, Fit, prior_rows
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.estimation.reported_model import ReportedModel
from hil_emulator.identify.estimation.sizes import Sizes
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
    """Drop an earlier effect that the last one has made superfluous.

    Args:
        fitter: with the training data; its gains are frozen anew.
        search: with an effect just taken into the model.
        tell: takes progress in words.

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
    """Tell whether the last effect makes the data hardly more likely, next to what others do.

    Each model has its own gains here. With gains of the model before, which correct much of what a
    law leaves, an effect may gain far more.

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
    """Return what the model loses in chi-square without one of its effects, refitted."""
    kept = {c.name for c in search.without(name)}
    stay = [i for i, c in enumerate(fit.coordinates) if c.name in kept]
    rest = [fit.coordinates[i] for i in stay]
    without = fitter.fit(rest, fit.at[stay], 3, jacobian=fit.jacobian[:, stay])
    return without.chi2 - fit.chi2


def weak_effects(search: Search) -> list[str]:
    """Return the effects that explain next to nothing, and may as well be something else or none.

    So may one that these data would not show if it were as large as usual, one beside which a
    candidate that was refused explained far more, one that explains less than a free term still
    does, one beside which ordinary parameters are where hardly any machine has them, and one that
    is no longer as far from none as a name has to be, once all is counted that leaves it uncertain.

    Args:
        search: finished, with what speaks against the laws of its effects.

    """
    left = search.rounds[-1].base
    unlikely = bool(highly_implausible_parameters(left))
    return [c.name for c in search.effects
            if (found := search.selected_in(c.name)).best < NOTICEABLE * _variance(found, left)
            and (c.name in search.law_mismatch or not found.trials[0].score.visible
                 or _weaker_than_rejected(found) or _weaker_than_free_term(search, found)
                 or unlikely or _insignificant(search, found, c.name))]  # fmt: skip


def _variance(named: Round, left: Fit) -> float:
    """Return the chi-square of which a gain is a share: by the noise by which it was computed."""
    return left.sample_size if left.effective is None else named.base.chi2


def deviation(search: Search, fit: Fit, name: str) -> float:
    """Return the standard deviation of an effect's coordinate, everything counted.

    Args:
        search: with the effect in the model.
        fit: of the model.
        name: of the effect.

    """
    known, lacking, _ = _deviations(search, fit, name)
    return math.hypot(known, lacking)


def interval(search: Search, fit: Fit, name: str) -> tuple[float, float]:
    """Return the 95 % interval of an effect's coordinate, given that the effect is there.

    That it is there, on this side of none, has passed a test; what no law explains leaves its size
    uncertain. So the distribution ends at none. How much a law lacks is told by a few numbers only:
    the distribution is Student's, of as many degrees of freedom as the sum of such a variance and
    one that is known has (Welch and Satterthwaite).
    """
    at = float(fit.at[[c.name for c in fit.coordinates].index(name)])
    known, lacking, told_by = _deviations(search, fit, name)
    spread, share = math.hypot(known, lacking), lacking**2 / (known**2 + lacking**2)
    # of millions of degrees it is a normal one
    degrees = told_by / max(share, 1e-3) ** 2
    absent = float(stdtr(degrees, -abs(at) / spread))
    ends = [abs(at) + spread * float(stdtrit(degrees, absent + (1.0 - absent) * part))
            for part in (0.025, 0.975)]  # fmt: skip
    low, high = sorted(math.copysign(end, at) for end in ends)
    return low, high


def _deviations(search: Search, fit: Fit, name: str) -> tuple[float, float, int]:
    """Return the standard deviation of an effect's coordinate by the data, and by its law.

    A law of another form fits as another value where the machine moves otherwise: by about the
    amplitude of what the law lacks over its own, which is the root of its part of the chi-square,
    or by as much as the values of the experiments are apart, if that is more. The third number is
    how many numbers tell it: those that a free shape has beside its size, or those experiments.
    """
    i = [c.name for c in fit.coordinates].index(name)
    lacking, told_by = (
        math.sqrt(search.lack_of_fit.get(name, 0.0)) * abs(float(fit.at[i])),
        HATS - 1,
    )
    if search.reported_model is None:
        spread = float(np.sqrt(fit.covariance()[i, i]))
        # estimated noise held the effect itself when it was named
        named = search.selected_in(name).trials[0].deviation if fit.effective is None else 0.0
        found = max(spread, named)
    else:
        found, sizes = search.reported_model.deviations[name], search.reported_model.sizes[name]
        if sizes.elsewhere > lacking:
            lacking, told_by = sizes.elsewhere, len(sizes.values) - 1
    known = math.hypot(found, discrepancy_uncertainty(search, fit)[i])
    return math.hypot(known, _confounding(search, fit, i)), lacking, told_by


def _confounding(search: Search, fit: Fit, i: int) -> float:
    """Return how much of a coordinate ordinary parameters may bear, where data do not tell."""
    unsure = fit.coordinates[i].name in search.law_mismatch or implausible_parameters(fit)
    return nuisance_confounding(fit, i) if unsure else 0.0


def nuisance_confounding(fit: Fit, i: int) -> float:
    """Return how much ordinary parameters may have taken over of an effect.

    That is by how much its coordinate would be another one if those were as configured that are
    more than two standard deviations off: a valve that is fitted slow may bear a part of what is
    late. Of an effect with the catalogue's law the data tell who bears it, unless they put one of
    them where one of twenty machines has any.
    """
    far = [j for j, c in enumerate(fit.coordinates)
           if np.isfinite(c.prior) and abs(fit.at[j]) > TOLERATED * c.prior]  # fmt: skip
    spread = fit.covariance()
    # two of them may stand in for each other, too
    back = np.linalg.pinv(spread[np.ix_(far, far)], hermitian=True) @ fit.at[far]
    return abs(float(spread[i, far] @ back))


def confounding_notes(search: Search, fit: Fit) -> list[str]:
    """Say of which effects strange parameters may bear more than all else leaves uncertain.

    Args:
        search: with the effects in the model.
        fit: of the model.

    """
    names, far = [c.name for c in fit.coordinates], implausible_parameters(fit)
    wide = [c.name for c in search.effects
            if 2.0 * _confounding(search, fit, names.index(c.name)) ** 2
            > deviation(search, fit, c.name) ** 2]  # fmt: skip
    if not far or not wide:
        return []
    part = f"that may bear a part of {' and of '.join(wide)}"
    return [f"{' and '.join(far)}: {part}, and the interval holds it"]


def heterogeneous_estimates(settled: ReportedModel | None) -> dict[str, str]:
    """Return the effects of which experiments want other sizes, and which, in words.

    They are farther apart than chance puts the sizes of one law, and than a law may be off.
    """
    if settled is None:
        return {}
    return {name: _from_to(sizes) for name, sizes in settled.sizes.items()
            if sizes.about and sizes.by_chance < FALSE_ALARM
            and sizes.spread**2 > LAW_TOLERANCE * sizes.about**2}  # fmt: skip


def _from_to(sizes: Sizes) -> str:
    """Say which sizes experiments want, those aside that hardly know."""
    each = [(value / sizes.about, variance / sizes.about**2)
            for value, variance in zip(sizes.values, sizes.variances, strict=True)]  # fmt: skip
    parts = [part for part, variance in each if variance < 1.0] or [part for part, _ in each]
    return f"experiments want from {min(parts):.0%} to {max(parts):.0%} of this size"


def discrepancy_uncertainty(search: Search, fit: Fit) -> Array:
    """Return the standard deviation of each coordinate that comes from what no law explains.

    Friction that changes along the stroke, say, is taken for something else in part: how much, its
    strength tells, while its shape is anyone's. Noise that is estimated holds it already. What the
    calibration of a sensor lacks is no uncertainty of an error of it, but a part of its law; and
    where ripple along the stroke was integrated out, that is counted already.
    """
    if fit.effective is not None:
        return np.zeros(len(fit.coordinates))
    last = search.rounds[-1]
    terms = last.terms if search.reported_model is None else search.reported_model.terms
    names = [c.name for c in last.base.coordinates]
    found = [(t, dict(zip(names, t.uncertainty, strict=True)))
             for t in terms if len(t.uncertainty)]  # fmt: skip
    return np.array([np.linalg.norm([d.get(c.name, 0.0) for t, d in found if not calibrates(t, c)])
                     for c in fit.coordinates])  # fmt: skip


def _weaker_than_rejected(found: Round) -> bool:
    """Tell whether another candidate explained far more than the one that was named."""
    gains = [t.evidence.delta_chi2 for t in found.trials if not t.partner]
    return max(gains, default=0.0) > found.best / GREATER_PART


def _weaker_than_free_term(search: Search, found: Round) -> bool:
    """Tell whether a free term still explains more than an effect did, chance set aside."""
    return any(t.excess > found.best for t in search.rounds[-1].terms)


def _insignificant(search: Search, found: Round, name: str) -> bool:
    """Tell whether an effect, everything counted, is less sure than a name has to be."""
    fit = search.reported or search.rounds[-1].base
    at = fit.at[[c.name for c in fit.coordinates].index(name)]
    return bool(abs(at) < math.sqrt(found.needed) * deviation(search, fit, name))


def implausible_parameters(fit: Fit, chance: float = SIGNIFICANCE) -> list[str]:
    """Return the ordinary parameters that are farther off than any is by chance, each in words.

    Args:
        fit: the finished model.
        chance: probability that any of them is as far off in a machine like the configured one.

    """
    return [
        f"{c.name} is {float(c.value(at)) / c.neutral:.2g} times its configured value"
        for c, at in outlying_parameters(fit, chance)
    ]


def outlying_parameters(fit: Fit, chance: float) -> list[tuple[Coordinate, float]]:
    """Return the ordinary parameters that are farther off than any is by chance, and where."""
    ordinary = sum(np.isfinite(c.prior) for c in fit.coordinates)
    deviations = math.sqrt(chi2_threshold(chance, int(ordinary)))
    return [
        (c, float(at)) for c, at in zip(fit.coordinates, fit.at, strict=True)
        if np.isfinite(c.prior) and c.neutral and abs(at) > deviations * c.prior
    ]  # fmt: skip


def prior_penalty(fit: Fit) -> float:
    """Return the part of chi-square from the priors of ordinary parameters."""
    return float(np.sum((prior_rows(fit.coordinates) * fit.at) ** 2))


def highly_implausible_parameters(fit: Fit) -> list[str]:
    """Return the ordinary parameters that hardly any healthy machine has so far off."""
    return implausible_parameters(fit, FALSE_ALARM)
