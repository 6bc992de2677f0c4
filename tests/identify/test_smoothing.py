"""Smoothed estimate of a missing term over time."""

import numpy as np

from hil_emulator.identify.prediction.filter.smoothing import smooth
from hil_emulator.identify.prediction.model_run.records import Entries, Gains, Jacobians

SAMPLES, STATES, CHANNELS, DECAY, VARIANCE = 30, 3, 2, 0.8, 2.5


def test_a_term_is_the_conditional_mean_of_all_innovations() -> None:
    """The smoother gives the mean of the joint normal distribution of term and innovations."""
    random = np.random.default_rng(7)
    gains = Gains(
        0.2 * random.normal(size=(SAMPLES, STATES, CHANNELS)),
        np.eye(CHANNELS) + 0.2 * random.normal(size=(SAMPLES, CHANNELS, CHANNELS)),
    )
    jacobians = Jacobians(
        0.4 * random.normal(size=(SAMPLES, STATES, STATES)),
        random.normal(size=(SAMPLES, CHANNELS, STATES)),
    )  # fmt: skip
    entries = Entries(
        random.normal(size=(SAMPLES, STATES)), random.normal(size=(SAMPLES, CHANNELS))
    )
    weights, residual = np.array([1.0, 0.7]), random.normal(size=(SAMPLES, CHANNELS))
    term = np.full(SAMPLES, np.nan)
    smooth(gains, jacobians, entries, weights, residual, DECAY, VARIANCE, term)
    # what each sample's term does to all later innovations, carried on by itself
    answers = np.zeros((SAMPLES, CHANNELS, SAMPLES))
    for j in range(SAMPLES - 1):
        deviation = np.zeros(STATES)
        for k in range(j, SAMPLES - 1):
            acting = float(k == j)
            reading = jacobians.senses[k] @ deviation + entries.feeds[k] * acting
            answers[k + 1, :, j] = weights * (gains.whitening[k + 1].T @ reading)
            deviation = jacobians.maps[k] @ deviation + entries.drives[k] * acting
            deviation = deviation - gains.kalman[k + 1] @ reading
    read_by_sample = answers.reshape(-1, SAMPLES)
    lag = np.abs(np.subtract.outer(np.arange(SAMPLES), np.arange(SAMPLES)))
    prior = VARIANCE * DECAY**lag
    mean = prior @ read_by_sample.T @ np.linalg.solve(
        read_by_sample @ prior @ read_by_sample.T + np.eye(len(read_by_sample)), residual.ravel()
    )  # fmt: skip
    np.testing.assert_allclose(term[:-1], mean[:-1], rtol=1e-8, atol=1e-10)
