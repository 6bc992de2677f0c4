"""Weak effects, confounded effects, and intervals of values."""

from dataclasses import replace

import numpy as np
import pytest

from hil_emulator.identify.estimation.experiment_estimates import EstimatesByExperiment
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.estimation.reported_model import ReportedModel
from hil_emulator.identify.prediction.free_terms.balances import CELL, PISTON
from hil_emulator.identify.prediction.plant.parameters import candidates, ordinary
from hil_emulator.identify.selection.certainty import (
    confounding_notes,
    discrepancy_uncertainty,
    heterogeneous_estimates,
    interval,
    nuisance_confounding,
    total_deviation,
    weak_effects,
)
from hil_emulator.identify.selection.evidence import Evidence, Trial
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import score_of
from tests.identify.rig_data import INSTRUMENTS, knee_model

COORDINATES = {c.name: c for c in candidates(knee_model(), INSTRUMENTS)}
N = 40_000


def search(
    delta_chi2: float, from_fit: float = 0.0, uncertainty: float = 0.0, information: float = 1e3,
    free: float = 0.0,
) -> Search:  # fmt: skip
    """Return a finished search that named friction of size one along the stroke.

    Args:
        delta_chi2: in chi-square.
        from_fit: standard deviation by the data; what it had when it was named is zero.
        uncertainty: the same by what no law explains.
        information: of the effect at its typical size, when it was named.
        free: gain of a free term in chi-square, of which ten are chance.

    """
    knob = COORDINATES["position_friction"]
    jacobian = np.zeros((N, 1))
    jacobian[0] = 1.0 / from_fit if from_fit else 1e6
    fit = Fit([knob], np.ones(1), np.zeros(N), jacobian, 0.0)
    score = replace(score_of(knob, jacobian[:, 0], Projection(fit)), information=information)
    trial = Trial(score, fit, Evidence(delta_chi2, delta_chi2, delta_chi2, 20.0), 0.0)
    named = Round(fit, [score], [trial], [], accepted=True)
    knots, nothing = np.zeros(6), np.zeros((0, 0))
    left = DiscrepancyTerm(
        PISTON, "time", free, 10.0, knots, knots, nothing, np.array([uncertainty])
    )
    return Search([], effects=[knob], rounds=[named, Round(fit, [], [], [left])])


@pytest.mark.parametrize(
    ("delta_chi2", "uncertainty", "too_faint"),
    [(300.0, 0.28, False), (300.0, 0.33, True), (500.0, 0.33, False)],
)
def test_a_weak_effect_needs_a_value_that_differs_from_zero(
    delta_chi2: float, uncertainty: float, too_faint: bool
) -> None:
    """Below 1 % of the variance, an effect must be significant at 1e-3 (3.29 deviations)."""
    assert (
        weak_effects(search(delta_chi2, uncertainty=uncertainty))
        == ["position_friction"] * too_faint
    )


@pytest.mark.parametrize(
    ("delta_chi2", "free", "too_faint"),
    [(300.0, 300.0, False), (300.0, 320.0, True), (500.0, 600.0, False)],
)
def test_a_weak_effect_explains_more_than_a_free_term(
    delta_chi2: float, free: float, too_faint: bool
) -> None:
    """A weak effect is dropped if a free term significantly gains more than it did."""
    assert weak_effects(search(delta_chi2, free=free)) == ["position_friction"] * too_faint


def test_a_weak_effect_needs_plausible_parameters() -> None:
    """A weak effect is dropped if the valve is six prior deviations off."""
    finished = search(300.0)
    valve = next(c for c in ordinary(knee_model()) if c.name == "valve_gain")
    last = finished.rounds[-1]
    for off, too_faint in ((2.0, False), (6.0, True)):
        free = [*finished.effects, valve]
        jacobian = np.column_stack([last.base.jacobian, np.zeros(N)])
        base = Fit(free, np.array([1.0, off]), np.zeros(N), jacobian, 0.0)
        finished.rounds[-1] = replace(last, base=base)
        left = replace(last.terms[0], uncertainty=np.zeros(2))
        finished.rounds[-1].terms = [left]
        assert weak_effects(finished) == ["position_friction"] * too_faint


@pytest.mark.parametrize(
    ("delta_chi2", "information", "too_faint"),
    [(300.0, 10.0, True), (300.0, 12.0, False), (500.0, 10.0, False)],
)
def test_a_weak_effect_is_visible_at_its_typical_size(
    delta_chi2: float, information: float, too_faint: bool
) -> None:
    """An effect without enough information is named for a large gain only."""
    finished = search(delta_chi2, information=information)
    assert weak_effects(finished) == ["position_friction"] * too_faint


@pytest.mark.parametrize(("refused", "too_faint"), [(590.0, False), (610.0, True)])
def test_a_weak_effect_gains_no_less_than_a_rejected_candidate(
    refused: float, too_faint: bool
) -> None:
    """A weak effect is dropped if a rejected candidate gained more than twice as much."""
    finished = search(300.0)
    named = finished.rounds[0]
    other = replace(named.trials[0], evidence=replace(named.trials[0].evidence, delta_chi2=refused))
    named.trials.append(other)
    assert weak_effects(finished) == ["position_friction"] * too_faint


@pytest.mark.parametrize(("delta_chi2", "too_faint"), [(300.0, True), (500.0, False)])
def test_a_weak_effect_needs_a_law_that_fits(delta_chi2: float, too_faint: bool) -> None:
    """A weak effect with a lack of fit is dropped."""
    finished = search(delta_chi2)
    finished.law_mismatch["position_friction"] = "a free term explains 74 % more"
    assert weak_effects(finished) == ["position_friction"] * too_faint


def test_independent_uncertainties_add_as_squares() -> None:
    """Uncertainties from data and from unexplained terms are independent: their squares add."""
    finished = search(100.0, from_fit=0.3, uncertainty=0.4)
    fit = finished.rounds[-1].base
    assert total_deviation(finished, fit, "position_friction") == pytest.approx(0.5, rel=1e-3)


def test_lack_of_fit_makes_a_value_uncertain() -> None:
    """A misfit of a quarter of the amplitude makes the value uncertain by a quarter."""
    finished = search(1e4, from_fit=0.1)
    finished.lack_of_fit["position_friction"] = 0.25**2
    fit = finished.rounds[-1].base
    assert total_deviation(finished, fit, "position_friction") == pytest.approx(
        np.hypot(0.1, 0.25), rel=1e-3
    )


@pytest.mark.parametrize(("off", "doubted"), [(3.0, True), (1.5, False)])
def test_the_confounded_part_of_an_effect_is_its_shift(off: float, doubted: bool) -> None:
    """The confounded part is the shift of the delay if the valve had its configured bandwidth."""
    valve = next(c for c in ordinary(knee_model()) if c.name == "valve_natural_frequency")
    delay, prior = COORDINATES["transport_delay"], np.array([0.0, 1.0 / valve.prior])
    slow = np.random.default_rng(4).normal(0.0, 50.0, (200, 2)) @ [[1.0, 2.0], [0.0, 3.0]]
    start = -slow @ [1.0, -off * valve.prior] + np.random.default_rng(5).standard_normal(200)
    at = np.linalg.lstsq(np.vstack([slow, np.diag(prior)]), np.append(-start, [0.0, 0.0]))[0]
    fit = Fit([delay, valve], at, start + slow @ at, slow, 0.0)
    as_configured = np.linalg.lstsq(slow[:, :1], -start)[0][0]
    expected = abs(as_configured - at[0]) if doubted else 0.0
    assert nuisance_confounding(fit, 0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("off", "other_law", "doubted"),
    [(1.5, True, False), (2.5, False, False), (2.5, True, True), (3.5, False, True)],
)
def test_a_value_with_an_implausible_parameter_is_uncertain(
    off: float, other_law: bool, doubted: bool
) -> None:
    """The interval is wider if an ordinary parameter is implausible, p < 0.05."""
    finished, name = search(1e4), "position_friction"
    usual = [c for c in ordinary(knee_model()) if c.stated]
    free, place = [*finished.effects, *usual], 1 + [c.name for c in usual].index("load_mass")
    at = np.zeros(len(free))
    at[0], at[place] = 1.0, off * free[place].prior
    shared = np.random.default_rng(6).standard_normal((300, 1))
    jacobian = shared + 0.3 * np.random.default_rng(7).standard_normal((300, len(free)))
    fit = Fit(free, at, np.zeros(300), jacobian / free[place].prior, 0.0)
    if other_law:
        finished.law_mismatch[name] = "another one"
    by_the_data = float(np.sqrt(fit.covariance()[0, 0]))
    moved = nuisance_confounding(fit, 0) if doubted else 0.0
    assert total_deviation(finished, fit, name) == pytest.approx(
        np.hypot(by_the_data, moved), rel=1e-9
    )
    notes = confounding_notes(finished, fit)
    assert len(notes) == (off == 3.5)
    assert all(line.startswith("load_mass") and name in line for line in notes)
    assert not doubted or moved > by_the_data


@pytest.mark.parametrize("doubt", [0.01, 0.3, 0.6, 2.0])
def test_an_interval_is_truncated_at_zero(doubt: float) -> None:
    """The interval excludes zero; 2.5 % of the other draws are beyond each end."""
    finished = search(1e4, uncertainty=doubt)
    low, high = interval(finished, finished.rounds[-1].base, "position_friction")
    draws = 1.0 + doubt * np.random.default_rng(1).standard_normal(400_000)
    assert [low, high] == pytest.approx(np.quantile(draws[draws > 0.0], [0.025, 0.975]), rel=0.02)
    assert 0.0 < low < 1.0 < high


def test_an_interval_with_lack_of_fit_has_few_degrees_of_freedom() -> None:
    """With a lack of fit from six hat functions, 95 % of the intervals contain the truth."""
    random, finished = np.random.default_rng(2), search(1e4)
    fit, inside = finished.rounds[-1].base, []
    fit = replace(fit, residual=fit.residual[:1], jacobian=fit.jacobian[:1])
    for _ in range(2000):
        lacking = 0.1 * random.standard_normal(5)
        finished.lack_of_fit["position_friction"] = float(np.mean(lacking**2))
        low, high = interval(finished, fit, "position_friction")
        inside.append(low < 1.0 + 0.1 * random.standard_normal() < high)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.015)


def test_an_interval_covers_a_further_experiment() -> None:
    """With seven heterogeneous estimates, 95 % of the intervals contain an eighth one."""
    random, finished = np.random.default_rng(3), search(1e4)
    fit, inside = finished.rounds[-1].base, []
    fit = replace(fit, residual=fit.residual[:1], jacobian=fit.jacobian[:1])
    for _ in range(2000):
        *drawn, eighth = (1.0 + 0.1 * random.standard_normal(8)).tolist()
        reported = replace(fit, at=np.array([np.mean(drawn)]))
        estimates = {
            "position_friction": EstimatesByExperiment(
                float(np.mean(drawn)), 1, [""] * 7, drawn, [1e-8] * 7
            )
        }
        finished.reported_model = ReportedModel(
            reported, {"position_friction": 1e-4}, estimates, []
        )
        low, high = interval(finished, reported, "position_friction")
        inside.append(low < eighth < high)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.015)


def test_the_larger_measure_of_lack_of_fit_counts() -> None:
    """Free terms measure a common misfit, estimates by experiment one without a regressor."""
    finished = search(1e4)
    fit, name = finished.rounds[-1].base, "position_friction"
    estimates = EstimatesByExperiment(1.0, 1, [""] * 3, [0.9, 1.0, 1.1], [1e-8] * 3)
    finished.reported_model = ReportedModel(fit, {name: 1e-4}, {name: estimates}, [])
    heterogeneous_estimates = 0.1 * np.sqrt(1.0 + 1.0 / 3.0)
    for lacks, expected in ((0.05**2, heterogeneous_estimates), (0.3**2, 0.3)):
        finished.lack_of_fit[name] = lacks
        assert total_deviation(finished, fit, name) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("values", "deviation", "other"),
    [([0.7, 1.0, 1.3], 0.05, True), ([0.9, 1.0, 1.1], 0.01, False), ([0.7, 1.0, 1.3], 0.2, False)],
)
def test_heterogeneous_estimates_show_another_law(
    values: list[float], deviation: float, other: bool
) -> None:
    """Differences must be significant, and exceed 12 %, the root of the tolerance of a law."""
    fit, name = search(1e4).rounds[-1].base, "position_friction"
    effects = [c for c in fit.coordinates if c.name == name]
    estimates = EstimatesByExperiment(1.0, 1, ["", "", ""], values, [deviation**2] * 3)
    words = heterogeneous_estimates(effects, ReportedModel(fit, {}, {name: estimates}, []))
    assert words == ({name: "single experiments give 70 to 130 % of this value"} if other else {})


@pytest.mark.parametrize(
    ("about", "parts"),
    [(0.0, {}), (0.01, {}), (0.025, {"position_friction": "-400 to 400 %"})],
)
def test_heterogeneous_estimates_about_zero_are_reported(
    about: float, parts: dict[str, str]
) -> None:
    """A value near zero has large relative differences, if the experiments determine it.

    Without that the estimates are not compared.
    """
    fit, name = search(1e4).rounds[-1].base, "position_friction"
    effects = [c for c in fit.coordinates if c.name == name]
    estimates = EstimatesByExperiment(about, 1, ["", "", ""], [-0.1, 0.0, 0.1], [0.02**2] * 3)
    words = heterogeneous_estimates(effects, ReportedModel(fit, {}, {name: estimates}, []))
    assert {n: part for n, part in parts.items() if part in words[n]} == parts
    assert bool(words) == bool(parts)


def test_the_misfit_of_a_calibration_counts_for_the_errors_of_its_sensor_only() -> None:
    """A misfit of a calibration curve widens the intervals of all but that sensor's gain."""
    finished = search(1e4)
    last = finished.rounds[-1]
    both = [COORDINATES["load_force.gain_error"], COORDINATES["pressure_a.gain_error"]]
    base = Fit(both, np.ones(2), np.zeros(N), np.zeros((N, 2)), 0.0)
    curve = replace(last.terms[0], balance=CELL, regressor="measured force",
                    uncertainty=np.array([0.3, 0.2]))  # fmt: skip
    finished.rounds[-1] = replace(last, base=base, terms=[curve])
    assert list(discrepancy_uncertainty(finished, base)) == [0.0, 0.2]
