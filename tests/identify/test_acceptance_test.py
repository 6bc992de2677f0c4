"""Acceptance test of a candidate."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import cauchy, chi2

from hil_emulator.identify.estimation.clusters import Clusters
from hil_emulator.identify.selection.evidence import Evidence
from hil_emulator.identify.selection.levels import needed_delta_chi2


def evidence(delta_chi2: float = 500.0, wald: float = 50.0, held_out: float = 400.0,
             variance_factor: float = 1.0) -> Evidence:  # fmt: skip
    """Return evidence that passes, unless a number is changed."""
    return Evidence(delta_chi2, wald, held_out, needed_delta_chi2(100), variance_factor)


def test_all_evidence_together_passes() -> None:
    """A candidate with a significant gain, Wald statistic and held-out gain passes."""
    assert evidence().passed


@pytest.mark.parametrize("candidates", [1, 10, 100, 1000])
def test_chance_names_nothing_among_any_number_of_candidates(candidates: int) -> None:
    """The false alarm rate is 1e-3 for the best of any number of candidates."""
    alone = chi2.cdf(needed_delta_chi2(candidates), 1)
    assert 1.0 - alone**candidates == pytest.approx(1e-3, rel=0.01)


def test_each_lack_is_an_objection() -> None:
    """An insignificant Wald statistic or held-out gain fails the test."""
    assert evidence(wald=20.0).passed
    assert not evidence(wald=19.0).passed
    assert not evidence(held_out=-3.0).passed


def test_a_value_that_looks_certain_must_gain_as_much() -> None:
    """In a curved valley the Wald statistic overestimates the likelihood ratio (Wilks 1938)."""
    assert not evidence(delta_chi2=62.0, wald=377.0, variance_factor=4.7).passed
    assert evidence(delta_chi2=100.0, wald=377.0, variance_factor=4.7).passed


def test_an_absurd_size_needs_plain_data() -> None:
    """Ten times the typical size needs 9 more in chi-square: the logarithm of a Cauchy density."""
    least = needed_delta_chi2(100) - 2.0 * np.log(cauchy.pdf(10.0) / cauchy.pdf(0.0))
    plausible = replace(evidence(), size=-10.0)
    assert replace(plausible, wald=1.001 * least).passed
    assert not replace(plausible, wald=0.999 * least).passed
    assert least - needed_delta_chi2(100) == pytest.approx(9.2, abs=0.1)


def test_held_out_data_must_show_it_too() -> None:
    """A held-out gain with p > 0.05 fails the test."""
    assert not evidence(held_out=chi2.ppf(0.949, 1)).passed
    assert evidence(held_out=chi2.ppf(0.951, 1)).passed


def test_serial_correlation_widens_the_variance() -> None:
    """Residuals correlated over 100 samples count as about 1/100 of as many."""
    random = np.random.default_rng(1)
    column, hundred = np.ones(20_000), Clusters(100, np.zeros(0, np.int64))
    white = random.standard_normal(20_000)
    slow = np.repeat(random.standard_normal(200), 100)
    assert 50.0 < hundred.variance_factor(column, slow) < 200.0
    assert hundred.variance_factor(column, white) < 1.5
