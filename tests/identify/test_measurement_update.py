"""Information of a measurement in a Kalman filter."""

import numpy as np
import pytest

from hil_emulator.identify.prediction.filter.extended_kalman_filter import estimate_of, update

STATES, READINGS = 6, 3


def measured(held: int, missing: int) -> tuple[np.ndarray, ...]:
    """Return covariance, slopes and noise before a measurement; covariance and gain after it."""
    random = np.random.default_rng(8)
    root = random.standard_normal((STATES, STATES))
    prior, slope = root @ root.T, random.standard_normal((READINGS, STATES))
    noise = np.array([0.1, 0.5, 2.0])
    estimate = estimate_of(prior, READINGS)
    if missing >= 0:
        estimate.present[missing] = False
    update(estimate, slope, noise, held)
    return prior, slope, noise, estimate.cov, estimate.gain


@pytest.mark.parametrize("missing", [-1, 1])
def test_a_measurement_adds_its_information(missing: int) -> None:
    """The inverse covariance grows by H^T R^-1 H, of the readings that there are."""
    prior, slope, noise, after, _ = measured(-1, missing)
    there = np.arange(READINGS) != missing
    information = slope[there].T @ np.diag(1.0 / noise[there]) @ slope[there]
    np.testing.assert_allclose(np.linalg.inv(after), np.linalg.inv(prior) + information, rtol=1e-9)


def test_a_consider_state_is_uncertain_and_not_corrected() -> None:
    """The covariance of the error is that of any gain (Joseph form)."""
    prior, slope, noise, after, gain = measured(2, -1)
    assert not gain[2].any()
    assert np.all(gain[np.arange(STATES) != 2].any(axis=1))
    left = np.eye(STATES) - gain @ slope
    joseph = left @ prior @ left.T + gain @ np.diag(noise) @ gain.T
    np.testing.assert_allclose(after, joseph, rtol=1e-9, atol=1e-12)
    assert after[2, 2] == prior[2, 2]


def test_readings_that_are_nearly_exact_leave_no_negative_variance() -> None:
    """A sensor reduces a variance by twelve orders of magnitude, with units far apart."""
    units = np.array([1e7, 1e-3, 1e-2])
    estimate = estimate_of(np.diag(units**2), 3)
    noise = (1e-6 * units) ** 2
    for _ in range(100):
        update(estimate, np.eye(3), noise, -1)
    np.testing.assert_allclose(np.diag(estimate.cov), noise / 100.0, rtol=0.02)
