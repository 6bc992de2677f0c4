"""Evidence of additional free terms, in a linear model and in simulated machines."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from hil_emulator.identify.estimation import shape_sums
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.log_evidence import LogEvidence
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.outer_iteration import converge
from hil_emulator.identify.estimation.shape_sums import ShapeSums, Sums
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.parallel.pool import Threads
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.selection.discrepancies import Discrepancies
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

RESISTANCE = 3e13
"""Of a return line that the configuration lacks [Pa*s^2/m^6]."""

ORDINARY = [c for c in parameters.ordinary(knee_model()) if c.stated]
COORDINATES = {c.name: c for c in parameters.candidates(knee_model(), INSTRUMENTS)}


def summed(columns: np.ndarray, jacobian: np.ndarray, residual: np.ndarray) -> Sums:
    """Return the sums over some rows, added in two parts."""
    sums = Sums.zeros(len(columns), jacobian.shape[1])
    for rows in (slice(0, 7), slice(7, None)):
        sums.add(columns[:, rows], jacobian[rows], residual[rows])
    return sums


@pytest.mark.parametrize("inflation", [1.0, 3.0])
def test_the_evidence_is_the_density_of_the_data(inflation: float) -> None:
    """In a linear model the evidence is scipy's normal density."""
    random = np.random.default_rng(4)
    columns, jacobian = random.standard_normal((3, 40)), random.standard_normal((40, 2))
    residual, at = 2.0 * random.standard_normal(40), np.array([0.7, -1.2])
    free = ORDINARY[:2]
    fit = Fit(free, at, residual, jacobian, 0.0)
    sums = summed(columns, jacobian, residual)
    evidence = LogEvidence(fit, sums, Sums.zeros(3, 2), inflation)
    rows, root = np.array([0, 2]), np.array([[0.5, 0.0], [0.3, 0.8]])
    prior = np.diag([c.prior**2 for c in free])

    def density(terms: np.ndarray) -> float:
        noise = inflation * np.eye(40) + jacobian @ prior @ jacobian.T + terms
        return float(multivariate_normal(jacobian @ at, noise).logpdf(residual))

    spread = columns[rows].T @ root
    exact = density(spread @ spread.T) - density(np.zeros((40, 40)))
    nothing = evidence(np.zeros(0, dtype=int), np.zeros((0, 0)))
    assert sum(evidence(rows, root)) - sum(nothing) == pytest.approx(exact, rel=1e-9)


def test_terms_and_coordinates_are_those_of_linear_regression() -> None:
    """Posterior means and covariances are those of the joint normal distribution."""
    random = np.random.default_rng(6)
    columns, jacobian = random.standard_normal((3, 40)), random.standard_normal((40, 2))
    residual, at = 2.0 * random.standard_normal(40), np.array([0.7, -1.2])
    free = ORDINARY[:2]
    sums = summed(columns, jacobian, residual)
    evidence = LogEvidence(Fit(free, at, residual, jacobian, 0.0), sums, Sums.zeros(3, 2), 1.5)
    root = np.diag([0.5, 0.3, 0.8])
    both = np.hstack([jacobian, columns.T])
    prior = np.concatenate([[1.0 / c.prior**2 for c in free], 1.0 / np.diag(root) ** 2])
    joint = np.linalg.inv(both.T @ both / 1.5 + np.diag(prior))
    means = -joint @ (both.T @ residual / 1.5 + prior * np.concatenate([at, np.zeros(3)]))
    terms, covariance = evidence.terms(root)
    np.testing.assert_allclose(terms, means[2:], rtol=1e-9)
    np.testing.assert_allclose(covariance, joint[2:, 2:], rtol=1e-9)
    np.testing.assert_allclose(evidence.shift(terms), means[:2], rtol=1e-9)
    np.testing.assert_allclose(evidence.covariance(covariance), joint[:2, :2], rtol=1e-9)


def test_held_out_data_count_by_their_prediction() -> None:
    """Their density is that at the most likely terms, given the trained coordinates."""
    random = np.random.default_rng(5)
    parts = [(random.standard_normal((2, 30)), random.standard_normal((30, 1)),
              random.standard_normal(30)) for _ in range(2)]  # fmt: skip
    columns, jacobian, residual = parts[0]
    at, free, inflation = np.array([0.4]), ORDINARY[:1], 1.5
    fit = Fit(free, at, residual, jacobian, 0.0)
    rows = np.arange(2)
    training = summed(*parts[0])
    without = LogEvidence(fit, training, Sums.zeros(2, 1), inflation)
    evidence = LogEvidence(fit, training, summed(*parts[1]), inflation)
    others, there, mean_there = parts[1]
    covariance = np.linalg.inv(jacobian.T @ jacobian / inflation + free[0].prior ** -2.0)
    spread = inflation * np.eye(30) + there @ covariance @ there.T

    def predicted(size: float) -> float:
        # ridge regression on everything at once
        design = np.column_stack([jacobian, columns.T])
        priors = np.array([free[0].prior ** -2.0, size**-2.0, size**-2.0])
        normal = design.T @ design / inflation + np.diag(priors)
        best = -np.linalg.solve(normal, design.T @ residual / inflation + priors * [at[0], 0, 0])
        mean = mean_there + np.column_stack([there, others.T]) @ best
        return float(multivariate_normal(np.zeros(30), spread).logpdf(mean))

    def held_out(size: float) -> float:
        root = size * np.eye(2)
        return evidence(rows, root)[0] - without(rows, root)[0]

    assert held_out(0.6) - held_out(0.2) == pytest.approx(predicted(0.6) - predicted(0.2), rel=1e-9)


def test_a_coordinate_that_only_held_out_data_determine_does_not_count() -> None:
    """A term gains nothing by changing a coordinate that the training data hardly determine.

    Example: the air in the oil, if a chamber empties in a held-out experiment only.
    """
    random = np.random.default_rng(8)
    jacobian, other = 0.01 * random.standard_normal((400, 1)), random.standard_normal((400, 1))
    column, noise = random.standard_normal((2, 400)), random.standard_normal((2, 400))
    # along the coordinate and a little across: with the term, its estimate is another one
    term = 30.0 * jacobian[:, 0] + 0.1 * column[0]
    free = ORDINARY[:1]
    wanted = free[0].prior
    fit = Fit(free, np.zeros(1), noise[0] + 0.05 * term, jacobian, 0.0)
    training = summed(term[None], jacobian, fit.residual)
    held = summed(0.1 * column[1:], other, noise[1] - wanted * other[:, 0])
    evidence = LogEvidence(fit, training, held, 1.0)
    nothing = evidence(np.zeros(0, dtype=int), np.zeros((0, 0)))
    gained = evidence(np.arange(1), np.eye(1))
    assert gained[0] - nothing[0] == pytest.approx(0.0, abs=3.0)


@pytest.fixture(scope="module")
def returning() -> tuple[Fitter, Fitter]:
    """Return training and validation data of a machine with a narrow return line."""
    changes = {"back_pressure_resistance": RESISTANCE}
    sides = [[recorded(changes, kind, seed + i) for i, kind in enumerate(("multisine", "steps"))]
             for seed in (3, 103)]  # fmt: skip
    first, second = (Fitter(Observer(knee_model(), INSTRUMENTS), side) for side in sides)
    return first, second


def discrepancies_of(sides: tuple[Fitter, Fitter], effects: list[Coordinate]) -> Discrepancies:
    """Return the discrepancies of a model with some effects."""
    fitter, other = sides
    free = [*ORDINARY, *effects]
    start = np.array([0.0] * len(ORDINARY) + [1.0] * len(effects))
    fit = converge(fitter, free, start, effects, 3)
    held = fitter.frozen_at(other.experiments, fit.coordinates, fit.at)
    return Discrepancies(fitter, fit, effects, fitter.linearised(fit, held))


def test_a_term_in_a_balance_without_a_named_effect_is_unknown(
    returning: tuple[Fitter, Fitter],
) -> None:
    """Without its effect, a return line is an unknown pressure over its flow."""
    discrepancies = discrepancies_of(returning, [])
    assert discrepancies.unknown()[0].title == "return pressure over return flow"
    assert discrepancies.other_laws() == {}


@pytest.mark.slow
def test_nothing_is_left_with_the_true_law(returning: tuple[Fitter, Fitter]) -> None:
    """With the true law no noticeable term remains, and no lack of fit."""
    discrepancies = discrepancies_of(returning, [COORDINATES["back_pressure"]])
    assert discrepancies.unknown() == []
    assert discrepancies.other_laws() == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "name"),
    [({"fixed_pump_flow": 3e-5}, "fixed_pump"),
     ({"back_pressure_resistance": RESISTANCE}, "back_pressure")],
)  # fmt: skip
def test_the_contribution_of_an_effect_is_that_of_a_model_without_it(
    changes: dict[str, float], name: str
) -> None:
    """The contribution of a saturating pump, whose tangent gives 75 % too much, is exact, too."""
    sides = [[recorded(changes, kind, seed + i) for i, kind in enumerate(("multisine", "steps"))]
             for seed in (3, 103)]  # fmt: skip
    fitter, other = (Fitter(Observer(knee_model(), INSTRUMENTS), side) for side in sides)
    free = [*ORDINARY, COORDINATES[name]]
    fit = converge(fitter, free, np.array([0.0] * len(ORDINARY) + [1.0]), free[-1:], 3)
    held = fitter.frozen_at(other.experiments, free, fit.at)
    discrepancies = Discrepancies(fitter, fit, free[-1:], fitter.linearised(fit, held))
    without = fitter.fit(ORDINARY, fit.at[:-1], 6)
    assert discrepancies.contributions[name].unique == pytest.approx(
        without.chi2 - fit.chi2, rel=0.12
    )


@pytest.mark.slow
def test_a_law_that_does_not_fit_is_reported() -> None:
    """Friction that grows towards the ends of the stroke, named as asymmetric friction."""
    changes = {"position_friction_rise": 1.0}
    sides = [[recorded(changes, kind, seed + i) for i, kind in enumerate(("multisine", "steps"))]
             for seed in (7, 107)]  # fmt: skip
    fitter, other = (Fitter(Observer(knee_model(), INSTRUMENTS), side) for side in sides)
    discrepancies = discrepancies_of((fitter, other), [COORDINATES["friction_asymmetry"]])
    assert (
        "a free term in the force on the piston" in discrepancies.other_laws()["friction_asymmetry"]
    )
    assert discrepancies.unknown() == []


def test_sums_are_those_of_whole_columns(returning: tuple[Fitter, Fitter]) -> None:
    """Sums by experiment equal the products with the whole Jacobian and residual."""
    fitter, _ = returning
    fit = converge(fitter, ORDINARY, np.zeros(len(ORDINARY)), passes=1)
    sums = ShapeSums(fitter, fit).training()
    assert sums.rows == len(fit.residual)
    np.testing.assert_allclose(sums.normal, fit.jacobian.T @ fit.jacobian, rtol=1e-9)
    np.testing.assert_allclose(sums.slope, fit.jacobian.T @ fit.residual, rtol=1e-6, atol=1e-6)
    assert sums.power == pytest.approx(float(fit.residual @ fit.residual))


@pytest.mark.slow
def test_threads_and_pieces_do_not_change_the_sums(
    returning: tuple[Fitter, Fitter], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks of correlated residuals stay whole at any division of the rows."""
    predictor, logs = returning[0].predictor, returning[0].experiments
    sums_by_case = []
    for jobs, at_once in ((1, 10**6), (3, 1500)):
        fitter = Fitter(predictor, logs, Threads(predictor, jobs))
        fit = converge(fitter, ORDINARY, np.zeros(len(ORDINARY)), passes=1)
        held = np.random.default_rng(1).standard_normal(len(fit.residual))
        fit = replace(fit, residual=np.repeat(held, 50)[: len(held)])
        monkeypatch.setattr(shape_sums, "ROWS_AT_ONCE", at_once)
        sums = ShapeSums(fitter, fit)
        training = sums.training()
        sums_by_case.append(
            (training.shapes, training.mixed, training.onto, sums.inflations(training))
        )
    *products, inflations = zip(*sums_by_case, strict=True)
    for one, other in products:
        np.testing.assert_allclose(other, one, rtol=1e-5, atol=1e-5 * np.max(np.abs(one)))
    np.testing.assert_allclose(*inflations, rtol=1e-3)
    assert max(inflations[0]) > 1.5


def test_held_out_data_are_linearised_like_training_data(
    returning: tuple[Fitter, Fitter],
) -> None:
    """For the training data the result is the Jacobian of the fit."""
    fitter, _ = returning
    free, at = ORDINARY[:3], np.zeros(3)
    fitter.freeze(free, at)
    base = fitter.residual(free, at)
    here = fitter.jacobian(free, at, base)
    elsewhere = fitter.linearised(Fit(free, at, base, here, 0.0), fitter.batch)
    np.testing.assert_array_equal(elsewhere.residual, base)
    scale = np.linalg.norm(here, axis=0)
    np.testing.assert_allclose(elsewhere.jacobian / scale, here / scale, atol=1e-2)
