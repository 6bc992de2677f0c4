"""Named laws and free terms against a candidate, and the nearest effect of a term."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import DiscrepancyTerm
from hil_emulator.identify.prediction.free_terms.balances import (
    CELL,
    LOAD,
    PISTON,
    RULER,
    TAP_A,
    Balance,
)
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.parameters import candidates, ordinary
from hil_emulator.identify.selection.certainty import (
    highly_implausible_parameters,
    implausible_parameters,
)
from hil_emulator.identify.selection.evidence import Evidence, Trial
from hil_emulator.identify.selection.law_form import displacing, judge, nearest
from hil_emulator.identify.selection.mixed_law import rejected_in_place
from hil_emulator.identify.selection.progress import Round, Search
from hil_emulator.identify.selection.scan import Score
from tests.identify.rig_data import INSTRUMENTS, knee_model

N = 1000


def effect(name: str) -> Coordinate:
    """Return an effect of the catalogue."""
    return next(c for c in candidates(knee_model(), INSTRUMENTS) if c.name == name)


def sensitivity() -> np.ndarray:
    """Return the derivative of the innovations by a term."""
    return np.sin(np.linspace(0.0, 20.0, N))


def term(balance: Balance, regressor: str, statistic: float) -> DiscrepancyTerm:
    """Return a term with such a gain and the critical value 50."""
    columns = np.column_stack([sensitivity(), np.cos(np.linspace(0.0, 20.0, N))])
    return DiscrepancyTerm(balance, regressor, statistic, 50.0, np.zeros(2), np.zeros(2), columns)


def score(name: str, statistic: float) -> Score:
    """Return the score of an effect."""
    # a projected column has a row more, for the prior
    column = np.append(sensitivity(), 0.0)
    return Score(effect(name), statistic, 1.0, statistic, column, sensitivity(), np.zeros(0))


def named(name: str, delta_chi2: float, terms: list[DiscrepancyTerm]) -> tuple[Trial, Round]:
    """Return an accepted effect with such a gain, and its round."""
    scored = score(name, delta_chi2)
    fit = Fit([scored.coordinate], np.ones(1), np.zeros(N), sensitivity()[:, None], 0.0)
    trial = Trial(scored, fit, Evidence(delta_chi2, delta_chi2, delta_chi2, 20.0), 1.0)
    return trial, Round(fit, [scored], [trial], terms, accepted=True)


@pytest.mark.parametrize(("free", "accepted"), [(1100.0, True), (5000.0, False)])
def test_an_effect_far_weaker_than_a_free_term_is_not_named(free: float, accepted: bool) -> None:
    """An unknown term with five times the gain prevents a name."""
    round_ = named("stribeck_friction", 1000.0, [term(LOAD, "velocity", free)])[1]
    round_.accepted = False
    judge(Search([]), round_)
    assert round_.accepted is accepted
    assert round_.unknown is not accepted


@pytest.mark.parametrize(
    ("name", "accepted"),
    [("load_force.gain_error", True), ("load_force.creep", False),
     ("load_force.crosstalk", False), ("pressure_a.gain_error", False),
     ("stribeck_friction", False)],
)  # fmt: skip
def test_a_curved_calibration_does_not_prevent_an_error_of_its_sensor(
    name: str, accepted: bool
) -> None:
    """A calibration curve that explains far more than a gain error allows the gain error."""
    round_ = named(name, 1000.0, [term(CELL, "measured force", 5000.0)])[1]
    round_.accepted = False
    judge(Search([]), round_)
    assert round_.accepted is accepted


def test_a_drifting_zero_does_not_belong_to_friction() -> None:
    """Named friction does not prevent a name for the sensor's offset."""
    friction, round_ = named("friction_asymmetry", 1000.0, [term(TAP_A, "time", 900.0)])
    search = Search([], effects=[friction.score.coordinate])
    round_.trials, round_.accepted = [named("pressure_a.offset", 850.0, [])[0]], False
    judge(search, round_)
    assert round_.accepted


@pytest.mark.parametrize(("home", "accepted"), [(500.0, True), (1200.0, False)])
def test_a_term_elsewhere_must_not_gain_more_than_the_law(home: float, accepted: bool) -> None:
    """A term in another balance that gains more than any friction term is not friction."""
    terms = [term(PISTON, "velocity", home), term(LOAD, "velocity", 1150.0)]
    friction, round_ = named("friction_asymmetry", 1000.0, terms)
    search = Search([], effects=[friction.score.coordinate])
    round_.trials, round_.accepted = [named("pressure_a.offset", 850.0, [])[0]], False
    judge(search, round_)
    assert round_.accepted is accepted


def test_another_error_of_a_sensor_must_gain_more_than_a_free_shape_of_the_first() -> None:
    """The misfit of a delay of another form looks like cross-talk of the same sensor."""
    late, round_ = named("position.delay", 1000.0, [term(RULER, "acceleration", 900.0)])
    search = Search([], effects=[late.score.coordinate])
    other = named("position.crosstalk", 850.0, [])[0]
    round_.trials, round_.accepted = [other], False
    judge(search, round_)
    assert not round_.accepted


@pytest.mark.parametrize(
    ("earlier", "accepted"), [("load_force.offset", True), ("load_force.nonlinearity", False)]
)
def test_a_calibration_curve_contains_gain_errors_but_no_offset(
    earlier: str, accepted: bool
) -> None:
    """A term over the reading is a shape of any error with a slope, not of an offset."""
    first, round_ = named(earlier, 1000.0, [term(CELL, "measured force", 900.0)])
    search = Search([], effects=[first.score.coordinate])
    other = named("load_force.gain_error", 850.0, [])[0]
    round_.trials, round_.accepted = [other], False
    judge(search, round_)
    assert round_.accepted is accepted


@pytest.mark.parametrize(("delta_chi2", "accepted"), [(140.0, False), (160.0, True)])
def test_a_gain_within_the_tolerance_of_a_law_gets_no_name(
    delta_chi2: float, accepted: bool
) -> None:
    """After a gain of 10 000, a gain below 1.5 % of it is attributed to the named law."""
    first, before = named("internal_leakage", 10_000.0, [])
    before.accepted = True
    round_ = named("position_friction", delta_chi2, [])[1]
    round_.accepted = False
    judge(Search([], effects=[first.score.coordinate], rounds=[before, round_]), round_)
    assert round_.accepted is accepted


def test_an_implausible_parameter_is_reported_without_any_effect_too() -> None:
    """The report states that the model fits only with a valve of half the bandwidth."""
    valve = next(c for c in ordinary(knee_model()) if c.name == "valve_natural_frequency")
    jacobian = np.zeros((N, 1))
    far = Fit([valve], np.array([valve.at(0.5 * valve.neutral)]), np.zeros(N), jacobian, 0.0)
    assert implausible_parameters(far) == [
        "valve_natural_frequency is 0.5 times its configured value"
    ]
    near = Fit([valve], np.array([-valve.prior]), np.zeros(N), jacobian, 0.0)
    assert implausible_parameters(near) == []


def test_the_limit_of_plausibility_depends_on_the_number_of_parameters() -> None:
    """Three and a half standard deviations are significant for one parameter, not among 100."""
    valve = next(c for c in ordinary(knee_model()) if c.name == "valve_natural_frequency")
    one = Fit([valve], np.array([-3.5 * valve.prior]), np.zeros(N), np.zeros((N, 1)), 0.0)
    assert highly_implausible_parameters(one)
    at = np.append(one.at, np.zeros(99))
    many = Fit([valve] * 100, at, np.zeros(N), np.zeros((N, 100)), 0.0)
    assert not highly_implausible_parameters(many)


def test_the_nearest_effect_has_the_regressor_of_the_term() -> None:
    """A term over the pressures is nearest to pressure friction, in spite of a larger gain."""
    scores = [score("load_force.offset", 900.0), score("friction_asymmetry", 800.0),
              score("pressure_friction", 500.0), score("load_spring", 50.0)]  # fmt: skip
    pressures = term(PISTON, "pressure sum with the sign of velocity", 3000.0)
    assert nearest(pressures, scores) == "pressure_friction"
    assert nearest(term(LOAD, "position", 3000.0), scores) == "load_spring"
    assert nearest(term(LOAD, "time", 3000.0), scores[:1]) == ""


@pytest.mark.parametrize(
    ("name", "left", "displaced"),
    [("stribeck_friction", 0.0, True), ("stribeck_friction", 0.05, True),
     ("stribeck_friction", 0.3, False),
     ("internal_leakage", 0.0, False)],
)  # fmt: skip
def test_friction_that_replaces_dry_friction_has_another_law(
    name: str, left: float, displaced: bool
) -> None:
    """A fitted Coulomb friction of nearly zero shows a misfit of friction, not of leaks."""
    dry = next(c for c in ordinary(knee_model()) if c.name == "coulomb_friction")
    at = np.array([(left - 1.0) * dry.neutral / dry.scale, 1.0])
    fit = Fit([dry, effect(name)], at, np.zeros(N), np.zeros((N, 2)), 0.0)
    assert list(displacing([effect(name)], fit)) == [name] * displaced


@pytest.mark.parametrize(
    ("refused", "delta_chi2", "wald", "left"),
    [("null_bias", 300.0, 250.0, True), ("null_bias", 100.0, 90.0, False),
     ("null_bias", 300.0, 10.0, False), ("null_bias", 6000.0, 5000.0, False),
     ("load_force.offset", 300.0, 250.0, False)],
)  # fmt: skip
def test_a_rejected_candidate_at_the_same_place_is_a_misfit(
    refused: str, delta_chi2: float, wald: float, left: bool
) -> None:
    """A rejected candidate at the same place that gains 3 % of the effect's gain shows another law.

    Exceptions are a gain of 1 %, within the tolerance; a gain of most of it, a further effect; and
    an error of the load cell, at another place.
    """
    first, round_ = named("threshold", 10_000.0, [])
    other = Trial(
        score(refused, delta_chi2), first.fit, Evidence(delta_chi2, wald, -5.0, 20.0), 1.0
    )
    search = Search([], effects=[effect("threshold")], rounds=[round_])
    search.rounds.append(Round(first.fit, [other.score], [other], []))
    refused_there = rejected_in_place(search)
    assert refused_there == ({"threshold": (refused, 0.03)} if left else {})
