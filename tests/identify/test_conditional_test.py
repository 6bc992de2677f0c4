"""Gains conditional on named laws, for problems with a known answer."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.excerpt import Excerpt
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.prediction.free_terms.balances import FLOW_B, LEAKAGE, LOAD, Balance
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.parameters import candidates
from hil_emulator.identify.selection.evidence import Evidence, Trial, ranked
from hil_emulator.identify.selection.law_form import ConditionalTest, judge, untried_independent
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Score, score_of
from tests.identify.rig_data import INSTRUMENTS, knee_model

COORDINATES = {c.name: c for c in candidates(knee_model(), INSTRUMENTS)}
N = 2000
LEAK, SHAPE, NULL, BEND, SPRING = (
    np.sin(2.0 * np.pi * (3 + k) * np.arange(N) / N) * np.sqrt(2.0 / N) for k in range(5)
)
"""Sensitivities at right angles, each of length one: a leak, what another law of it leaves, ..."""

OTHER_LEAK = 0.6 * SHAPE + 0.8 * BEND


def base(residual: np.ndarray) -> Fit:
    """Return a model with a leak that leaves a residual."""
    leak = COORDINATES["internal_leakage"]
    return Fit([leak], np.ones(1), residual, 100.0 * LEAK[:, None], float(residual @ residual))


def term(balance: Balance, regressor: str, fit: Fit, *columns: np.ndarray) -> DiscrepancyTerm:
    """Return a free term with such a column; its critical value is 10."""
    delta_chi2 = sum(float(c @ fit.residual) ** 2 for c in columns)
    knots = np.zeros(6)
    return DiscrepancyTerm(
        balance, regressor, delta_chi2, 10.0, knots, knots, np.column_stack(columns)
    )


def candidate(name: str, fit: Fit, sensitivity: np.ndarray) -> Score:
    """Return the score of an effect with fifty such columns as typical size."""
    return score_of(COORDINATES[name], -50.0 * sensitivity, Projection(fit))


def judged(spring: float, *names: str) -> Round:
    """Return a round after a leak with a misfit was named.

    It leaves 70, the null 22, something at the load `spring` standard deviations.
    """
    fit = base(70.0 * SHAPE + 22.0 * NULL + spring * SPRING)
    terms = [
        term(LEAKAGE, "pressure difference", fit, LEAK, SHAPE),
        term(FLOW_B, "pressure b", fit, SHAPE),
        term(LOAD, "velocity", fit, SPRING),
    ]
    sensitivities = {"null_bias": NULL, "external_leakage": OTHER_LEAK}
    round_ = Round(fit, [], [], terms)
    for name in names:
        score = candidate(name, fit, sensitivities[name])
        delta_chi2 = score.statistic
        round_.trials.append(
            Trial(score, fit, Evidence(delta_chi2, delta_chi2, delta_chi2, 20.0), 1.0)
        )
    search = Search([], effects=[COORDINATES["internal_leakage"]])
    judge(search, round_)
    return round_


def test_the_misfit_of_a_law_is_not_a_gain_of_another_effect() -> None:
    """Conditional on the leak, a null bias keeps its gain and another leak gains nothing."""
    fit = base(70.0 * SHAPE + 22.0 * NULL)
    test = ConditionalTest([term(LEAKAGE, "pressure difference", fit, LEAK, SHAPE)], fit)
    assert test.candidate(candidate("null_bias", fit, NULL)) == pytest.approx(22.0**2)
    other = candidate("external_leakage", fit, OTHER_LEAK)
    assert other.statistic == pytest.approx(42.0**2)
    assert test.candidate(other) == pytest.approx(0.0, abs=1e-3)
    assert test.candidate(candidate("external_leakage", fit, SHAPE)) == 0.0


def test_a_term_that_is_the_misfit_of_a_law_gains_nothing() -> None:
    """A flow term that shows the misfit of the leak gains nothing conditional on the leak."""
    fit = base(70.0 * SHAPE + 22.0 * NULL)
    test = ConditionalTest([term(LEAKAGE, "pressure difference", fit, LEAK, SHAPE)], fit)
    assert test.term(term(FLOW_B, "pressure b", fit, SHAPE)) == pytest.approx(0.0, abs=1e-6)
    both = term(FLOW_B, "pressure b", fit, SHAPE + NULL, BEND)
    assert test.term(both) == pytest.approx(22.0**2)


def test_a_second_effect_is_named_next_to_a_law_that_does_not_fit() -> None:
    """The null is named although the misfit of the leak is larger and resembles another leak."""
    round_ = judged(0.0, "external_leakage", "null_bias")
    assert round_.accepted
    assert round_.trials[0].score.coordinate.name == "null_bias"
    assert not judged(0.0, "external_leakage").accepted


@pytest.mark.parametrize(("spring", "accepted"), [(30.0, True), (60.0, False)])
def test_no_name_if_an_unknown_term_explains_far_more(spring: float, accepted: bool) -> None:
    """Next to a misfit, too, an unknown term with seven times the gain prevents a name."""
    round_ = judged(spring, "null_bias")
    assert round_.accepted is accepted
    assert round_.unknown is not accepted


@pytest.mark.parametrize(("law", "accepted"), [(70.0, True), (200.0, False)])
def test_a_gain_above_that_of_any_shape_of_a_law_is_another_effect(
    law: float, accepted: bool
) -> None:
    """A candidate that gains more than any shape of a named law is named."""
    fit = base(law * SHAPE + 70.0 * BEND)
    score = candidate("gain_asymmetry", fit, 0.7 * SHAPE + 0.7 * BEND)
    gain = score.statistic
    trial = Trial(score, fit, Evidence(gain, 50.0, gain, 20.0, serial_factor=200.0), 1.0)
    terms = [
        term(LEAKAGE, "pressure difference", fit, LEAK, SHAPE),
        term(LEAKAGE, "position times pressure difference", fit, LEAK, BEND),
    ]
    round_ = Round(fit, [score], [trial], terms)
    judge(Search([], effects=[COORDINATES["internal_leakage"]]), round_)
    assert round_.accepted is accepted


@pytest.mark.parametrize(("law", "keeps"), [(35.0, True), (70.0, False)])
def test_an_independent_effect_keeps_nearly_all_of_its_gain(law: float, keeps: bool) -> None:
    """A candidate with a large part of its gain in the misfit is not independent."""
    fit = base(law * SHAPE + 70.0 * NULL)
    test = ConditionalTest([term(LEAKAGE, "pressure difference", fit, LEAK, SHAPE)], fit)
    score = candidate("null_bias", fit, 0.2 * SHAPE + 0.98 * NULL)
    assert test.keeps_its_gain(score, 20.0) is keeps


@pytest.mark.parametrize(
    ("tried", "law", "expected"),
    [
        # another leak explains more of what the leak's law leaves, and is tried first
        ("external_leakage", 70.0, ["null_bias"]),
        # the second call must not happen
        ("null_bias", 70.0, []),
        # a law that leaves nothing overshadows nothing
        ("external_leakage", 0.0, []),
    ],
)
def test_effects_elsewhere_are_tried_next_to_a_law_that_does_not_fit(
    tried: str, law: float, expected: list[str]
) -> None:
    """A null bias is refitted although four candidates have larger scores by the misfit."""
    fit = base(law * SHAPE + 22.0 * NULL)
    sensitivities = {
        "null_bias": NULL,
        "external_leakage": OTHER_LEAK,
        # acts elsewhere, but half of it looks like what the leak leaves
        "gain_asymmetry": 0.7 * SHAPE + 0.7 * NULL,
    }
    scores = [candidate(name, fit, column) for name, column in sensitivities.items()]
    first = next(s for s in scores if s.coordinate.name == tried)
    weak = Trial(first, fit, Evidence(300.0, 9.0, 300.0, 20.0), 1.0)
    whole = Excerpt(Fitter(Observer(knee_model(), INSTRUMENTS), []), fit)
    terms = [term(LEAKAGE, "pressure difference", fit, LEAK, SHAPE)]
    judged = Round(fit, scores, [weak], terms, excerpt=whole)
    search = Search([], effects=[COORDINATES["internal_leakage"]])
    assert [s.coordinate.name for s in untried_independent(search, judged)] == expected


def test_candidates_without_gain_are_ordered() -> None:
    """If no refit improves the fit, the least harmful candidate comes first."""
    fit = base(22.0 * NULL)
    score = candidate("null_bias", fit, NULL)
    trials = [Trial(score, fit, Evidence(g, 0.0, 1.0, 20.0), 1.0) for g in (-30.0, -20.0)]
    assert [t.evidence.delta_chi2 for t in ranked(trials)] == [-20.0, -30.0]


@pytest.mark.parametrize(
    ("first_gains", "other", "first"),
    [
        # their gains differ by 1 % on held-out data and by 10 % on the others: all data decide
        ((60_000.0, 44_600.0), (55_800.0, 44_900.0), (60_000.0, 44_600.0)),
        # a law that bends to its data has failed, however many it explains
        ((60_000.0, 30_000.0), (55_800.0, 44_900.0), (55_800.0, 44_900.0)),
    ],
)
def test_the_total_gain_orders_equivalent_candidates(
    first_gains: tuple[float, float], other: tuple[float, float], first: tuple[float, float]
) -> None:
    """Held-out gains order candidates; total gains order those with nearly equal ones."""
    fit = base(22.0 * NULL)
    score = candidate("null_bias", fit, NULL)
    trials = [Trial(score, fit, Evidence(g, 0.0, h, 20.0), 1.0) for g, h in (first_gains, other)]
    best = ranked(trials)[0].evidence
    assert (best.delta_chi2, best.held_out) == first


@pytest.mark.parametrize(("hats", "worth"), [(6, True), (24, False)])
def test_a_term_with_more_hats_needs_a_larger_gain(hats: int, worth: bool) -> None:
    """A gain that is noticeable with 6 hat functions is not with 24."""
    fit = base(22.0 * NULL)
    knots = np.zeros(hats)
    statistic = 2.0 * 0.01 * N + 5.0
    ripple = DiscrepancyTerm(
        LOAD, "position", statistic, 10.0, knots, knots, NULL[:, None], null_mean=5.0
    )
    assert bool(Round(fit, [], [], [ripple]).noticeable) is worth
