"""Thresholds of a search: each claim holds with its value, and fails at a tenth or ten times."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chi2

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.prediction.free_terms.balances import PISTON
from hil_emulator.identify.prediction.free_terms.free_shapes import HATS
from hil_emulator.identify.selection import discrepancies, levels
from hil_emulator.identify.selection.evidence import Evidence, Trial, ranked
from hil_emulator.identify.selection.law_form import judge
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Score
from tests.identify.test_law_objections import effect, named, term
from tests.studies.rules.rules import changed

BELIEFS = ("LAW_ERROR_SIZES", "VARIANCE_SHARES", "SMOOTH")
BELIEVED = ("discrepancies",)
WHERE = {
    "GREATER_PART": ("law_form",), "NEARLY_ALL": ("evidence",), "SMALL_PART": ("evidence",),
    "LAW_TOLERANCE": ("law_form",), "NOTICEABLE": ("progress",), **dict.fromkeys(BELIEFS, BELIEVED),
}  # fmt: skip
"""The module that asks, of a number that several ask for."""


def false_alarms() -> bool:
    """With 100 candidates, one healthy machine in 1000 has a significant one."""
    alone = chi2.cdf(levels.needed_delta_chi2(100), 1)
    return bool(abs(1.0 - alone**100 - 1e-3) < 1e-4)


def far_more_is_unknown() -> bool:
    """Return whether a free term prevents a name with five times the gain, not with 1.1 times."""
    accepted = []
    for gain in (1100.0, 5000.0):
        round_ = named("stribeck_friction", 1000.0, [term(PISTON, "velocity", gain)])[1]
        judge(Search([]), round_)
        accepted.append(round_.accepted)
    return accepted == [True, False]


def _trial(name: str, gain: float, held: float) -> Trial:
    score = Score(effect(name), gain, 1.0, gain, np.zeros(0), np.zeros(0), np.zeros(0))
    fit = Fit([score.coordinate], np.ones(1), np.zeros(0), np.zeros((0, 1)), 0.0)
    return Trial(score, fit, Evidence(gain, gain, held, 20.0), 1.0)


def rivals_are_judged_by_held_out_data() -> bool:
    """Held-out data may choose a candidate with 80 % of the best gain, not with 20 %."""
    first = [ranked([_trial("internal_leakage", 1000.0, 500.0),
                     _trial("position_friction", gain, 900.0)])[0].score.coordinate.name
             for gain in (800.0, 200.0)]  # fmt: skip
    return first == ["position_friction", "internal_leakage"]


def equals_are_ordered_by_their_shapes() -> bool:
    """Of two candidates within 5 %, the one without assumed shapes comes first."""
    names = ("stribeck_friction", "friction_asymmetry")
    assert len(effect(names[0]).effect.shape) > len(effect(names[1]).effect.shape)  # type: ignore[union-attr]
    first = [ranked([_trial(names[0], 1000.0, 1000.0), _trial(names[1], gain, gain)])[0]
             for gain in (950.0, 800.0)]  # fmt: skip
    return [t.score.coordinate.name for t in first] == [names[1], names[0]]


def a_law_has_a_tolerance() -> bool:
    """After a gain of 10 000, a gain of 0.5 % is within the tolerance, 10 % is not."""
    accepted = []
    for gain in (50.0, 1000.0):
        first, before = named("internal_leakage", 10_000.0, [])
        round_ = named("position_friction", gain, [])[1]
        round_.accepted = False
        judge(Search([], effects=[first.score.coordinate], rounds=[before, round_]), round_)
        accepted.append(round_.accepted)
    return accepted == [False, True]


def ripple_is_not_noticeable() -> bool:
    """Return whether 1/30 of the variance is noticeable, and 1/300 is not."""
    fit = Fit([], np.zeros(0), np.ones(40_000), np.zeros((40_000, 0)), 4e4)
    terms = [term(PISTON, "position", gain) for gain in (133.0, 1333.0)]
    whole = [Round(fit, [], [], [t]).noticeable for t in terms]
    return [bool(w) for w in whole] == [False, True]


def prior_errors_of_laws_are_realistic() -> bool:
    """Return whether the prior covers the errors of a linear law for power laws.

    For x^n between 0 and 1, the best a x has a = 3 / (n + 2). Orifices have n = 1/2, turbulent gaps
    4/7, drag 2, an odd sensor curve 3.
    """
    missed = [np.sqrt(1.0 - 3.0 * (2.0 * n + 1.0) / (n + 2.0) ** 2) for n in (0.5, 4 / 7, 2.0, 3.0)]
    sizes = discrepancies.LAW_ERROR_SIZES
    return all(min(sizes) < m < 1.01 * max(sizes) for m in missed)


def prior_shares_cover_all_terms() -> bool:
    """Return whether the prior covers chance for 40 000 residuals up to all of their variance."""
    by_chance = HATS / 40_000
    shares = discrepancies.VARIANCE_SHARES
    return min(shares) < by_chance < 1e-3 < 1.0 < max(shares) < 10.0


def terms_are_smooth_but_not_straight() -> bool:
    """Neighbouring hats are correlated, those at the ends of the range are not."""
    root = discrepancies._smooth(HATS)
    kernel = root @ root.T
    return bool(0.5 < kernel[0, 1] < 0.95 and abs(kernel[0, -1]) < 0.05)


CLAIMS: dict[str, Callable[[], bool]] = {
    "FALSE_ALARM": false_alarms, "GREATER_PART": far_more_is_unknown,
    "NEARLY_ALL": rivals_are_judged_by_held_out_data,
    "SMALL_PART": equals_are_ordered_by_their_shapes, "LAW_TOLERANCE": a_law_has_a_tolerance,
    "NOTICEABLE": ripple_is_not_noticeable, "LAW_ERROR_SIZES": prior_errors_of_laws_are_realistic,
    "VARIANCE_SHARES": prior_shares_cover_all_terms,
    "SMOOTH": terms_are_smooth_but_not_straight,
}  # fmt: skip


@pytest.mark.parametrize("name", CLAIMS)
def test_a_number_is_right_within_a_factor_of_ten(name: str) -> None:
    """The claim holds with the number, and neither with a tenth nor with ten times of it."""
    claim, value = CLAIMS[name], getattr(discrepancies if name in BELIEFS else levels, name)
    assert claim(), claim.__doc__
    for factor in (0.1, 10.0):
        other = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
        with changed({f"{m}.{name}": other for m in WHERE.get(name, ("levels",))}):
            assert not _holds(claim), f"{factor} times: {claim.__doc__}"


def _holds(claim: Callable[[], bool]) -> bool:
    """Return whether a claim holds; False if no candidate is left to compare."""
    try:
        return claim()
    except IndexError:
        return False


def test_there_is_no_other_number() -> None:
    """Every number of the module is listed, or a quantile of a known distribution."""
    derived = {"SIGNIFICANCE", "NORMAL_95", "DISTINGUISHABLE"}
    assert {n for n in vars(levels) if n.isupper()} == {*CLAIMS, *derived} - {*BELIEFS}
