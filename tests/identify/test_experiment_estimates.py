"""Heterogeneity of the estimates of single experiments."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.experiment_estimates import (
    EstimatesByExperiment,
    parts_per_experiment,
)


def of(values: list[float], variances: list[float]) -> EstimatesByExperiment:
    """Return estimates with their variances."""
    return EstimatesByExperiment(
        1.0, 1, [str(i) for i in range(len(values))], list(values), list(variances)
    )


def test_the_spread_is_that_of_a_published_analysis() -> None:
    """Thirteen trials of a vaccine (Colditz et al. 1994), as in the manual of R's metafor."""
    values = [-0.8893, -1.5854, -1.3481, -1.4416, -0.2175, -0.7861, -1.6209, 0.0120, -0.4694,
              -1.3713, -0.3394, 0.4459, -0.0173]  # fmt: skip
    variances = [0.3256, 0.1946, 0.4154, 0.0200, 0.0512, 0.0069, 0.2230, 0.0040, 0.0564, 0.0730,
                 0.0124, 0.5325, 0.0714]  # fmt: skip
    assert of(values, variances).between_experiments ** 2 == pytest.approx(0.3088, abs=1e-3)


def test_p_values_of_a_correct_law_are_uniform() -> None:
    """With a correct law, p-values below 0.05 and 0.5 are as frequent as that."""
    random = np.random.default_rng(8)
    probabilities = [of((1.0 + random.standard_normal(6) * [0.1, 0.2, 0.1, 0.3, 0.1, 0.5]).tolist(),
               [0.01, 0.04, 0.01, 0.09, 0.01, 0.25]).p_value for _ in range(2000)]  # fmt: skip
    for probability in (0.05, 0.5):
        assert np.mean(np.array(probabilities) < probability) == pytest.approx(
            probability, abs=0.035
        )
    assert of([0.5, 1.0, 1.5], [1e-3] * 3).p_value < 1e-9
    assert of([0.5, 1.5], [1e-3] * 2).p_value == 1.0


def test_the_spread_of_exact_estimates_is_that_of_the_sample() -> None:
    """Without uncertainty the spread is the standard deviation of the sample."""
    values = [0.8, 1.0, 1.3, 1.1]
    assert of(values, [1e-12] * 4).between_experiments == pytest.approx(np.std(values, ddof=1))


def test_estimates_within_their_uncertainty_have_no_spread() -> None:
    """Differences by chance, or of two estimates, give no spread."""
    assert of([0.9, 1.0, 1.1], [0.04] * 3).between_experiments == 0.0
    assert of([0.0, 2.0], [1e-4] * 2).between_experiments == 0.0


def test_one_more_experiment_lies_among_the_others() -> None:
    """A further estimate deviates from the mean by the reported standard deviation."""
    random = np.random.default_rng(5)
    ratios = []
    for _ in range(2000):
        drawn = 1.0 + 0.3 * random.standard_normal(7) + 0.1 * random.standard_normal(7)
        estimates = of(drawn[:6].tolist(), [0.01] * 6)
        ratios.append((drawn[6] - drawn[:6].mean(), estimates.of_new_experiment))
    off, reported = np.array(ratios).T
    # the reported deviation does not include the uncertainty of the seventh size
    assert np.mean(off**2) - 0.01 == pytest.approx(np.mean(reported**2), rel=0.1)


def test_the_mean_of_heterogeneous_experiments_is_off_by_the_reported_deviation() -> None:
    """Their spread over the root of their number; nothing if they agree."""
    random = np.random.default_rng(6)
    ratios = []
    for _ in range(2000):
        drawn = of((0.3 * random.standard_normal(6)).tolist(), [1e-4] * 6)
        ratios.append((np.mean(drawn.values), drawn.of_mean))
    off, reported = np.array(ratios).T
    assert np.mean(off**2) == pytest.approx(np.mean(reported**2), rel=0.1)
    assert of([0.9, 1.0, 1.1], [0.04] * 3).of_mean == 0.0


def test_an_estimate_less_certain_than_its_prior_is_not_compared() -> None:
    """An ordinary parameter needs three estimates within its prior, an effect within its size."""
    values, variances = [0.5, 1.0, 1.5], [0.04] * 3
    spread = EstimatesByExperiment(0.01, 1, [""] * 3, values, variances, prior=1.0)
    assert spread.between_experiments > 0.0
    assert EstimatesByExperiment(0.01, 1, [""] * 3, values, variances).between_experiments == 0.0
    close = EstimatesByExperiment(0.01, 1, [""] * 3, values, variances, prior=0.1)
    assert close.between_experiments == 0.0


def test_an_estimate_and_its_variance_are_those_of_regression() -> None:
    """In white noise those of least squares, in correlated noise with the larger variance."""
    random = np.random.default_rng(2)
    white, lasting = [], []
    for _ in range(300):
        shown = np.repeat(random.standard_normal(40), 10)
        for noise, draws in (
            (random.standard_normal(400), white),
            (np.repeat(random.standard_normal(40), 10), lasting),
        ):
            estimates = EstimatesByExperiment(1.0, 10)
            # the machine has half as much more of it than the model
            estimates.add("", shown, noise - 0.5 * shown)
            draws.append((estimates.values[0], estimates.variances[0]))
    for draws in (white, lasting):
        values, variances = np.array(draws).T
        assert np.mean(values) == pytest.approx(1.5, abs=4.0 * np.std(values) / np.sqrt(300))
        assert np.mean(variances) == pytest.approx(np.var(values), rel=0.25)
    assert np.var(np.array(lasting)[:, 0]) > 5.0 * np.var(np.array(white)[:, 0])


def test_of_few_experiments_each_is_divided() -> None:
    """A single log is divided into quarters, whose estimates are compared."""
    assert [parts_per_experiment(count) for count in (1, 2, 3, 7)] == [4, 2, 1, 1]
    random = np.random.default_rng(4)
    shown = random.standard_normal(4000)
    # it grows from half of what is in the model to three halves
    growing = np.linspace(-0.5, 0.5, 4000) * shown
    estimates = EstimatesByExperiment(1.0, 10)
    estimates.add("a log", shown, 0.1 * random.standard_normal(4000) - growing, 4)
    assert estimates.names == [f"a log, part {i} of 4" for i in (1, 2, 3, 4)]
    assert estimates.values == pytest.approx([0.625, 0.875, 1.125, 1.375], abs=0.02)
    assert estimates.p_value < 1e-6
    short = EstimatesByExperiment(1.0, 100)
    short.add("a log", shown, growing, 4)
    assert short.names == ["a log, part 1 of 2", "a log, part 2 of 2"]


def test_an_experiment_without_information_has_no_estimate() -> None:
    """The experiment is left out."""
    estimates = EstimatesByExperiment(1.0, 10)
    estimates.add("", np.zeros(40), np.ones(40))
    assert estimates.values == []


def test_undetermined_estimates_are_not_compared() -> None:
    """If too few experiments determine the effect, the p-value is 1 and the spread 0."""
    values, variances = [3.2, 40.0, -60.0, 25.0], [0.5, 4.0, 9.0, 4.0]
    assert of(values, variances).p_value == 1.0
    assert of(values, variances).between_experiments == 0.0
    assert of(values, [0.5, 0.5, 0.5, 4.0]).p_value < 1e-6
