"""How many independent values correlated residuals are worth, at any sample rate."""

import numpy as np
import pytest

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.residuals.correlation import (
    Noise,
    block_time,
    correlogram,
    shared,
)

TIME_CONSTANT = 0.3
"""Of the process that tests look at [s]."""


def ornstein_uhlenbeck(rate: float, duration: float, seed: int) -> Array:
    """Return a stationary process of unit variance with an exponential autocovariance."""
    random = np.random.default_rng(seed)
    keep = np.exp(-1.0 / (rate * TIME_CONSTANT))
    values = np.empty(round(rate * duration))
    values[0] = random.standard_normal()
    for k, kick in enumerate(random.standard_normal(len(values) - 1)):
        values[k + 1] = keep * values[k] + np.sqrt(1.0 - keep**2) * kick
    return values


def noise_of(values: Array, rate: float) -> Noise:
    """Return the noise of one complete series."""
    return shared([correlogram(values, np.ones(len(values), bool), 1.0 / rate)])


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
def test_a_correlated_residual_is_worth_its_duration(rate: float) -> None:
    """Its spectral density at zero is twice the time constant, whatever the sample rate."""
    noises = [noise_of(ornstein_uhlenbeck(rate, 300.0, seed), rate) for seed in range(4)]
    assert np.mean([n.density for n in noises]) == pytest.approx(2.0 * TIME_CONSTANT, rel=0.2)
    assert np.mean([n.sample_size for n in noises]) == pytest.approx(500.0, rel=0.2)


def test_white_noise_is_worth_every_sample() -> None:
    """Nothing is correlated; every value counts."""
    values = np.random.default_rng(1).standard_normal(20_000)
    assert noise_of(values, 100.0).sample_size == pytest.approx(20_000, rel=0.1)


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
def test_blocks_are_as_long_as_residuals_are_correlated(rate: float) -> None:
    """Sums over them have most of the variance that the density at zero frequency gives them.

    Over a tenth of their length they would have less than half of it.
    """
    parts = [ornstein_uhlenbeck(rate, 60.0, seed)[:, None] for seed in range(6)]
    time = block_time(parts, [1.0 / rate] * len(parts), 0.1)
    shares = {}
    for length in (round(time * rate), round(0.1 * time * rate)):
        sums = [np.add.reduceat(p[:, 0], np.arange(0, len(p), length))[:-1] for p in parts]
        shares[length] = np.mean(np.square(sums)) / (length * rate * 2.0 * TIME_CONSTANT)
    whole, part = shares.values()
    assert 0.7 < whole < 1.1
    assert part < 0.5


def test_blocks_of_noise_that_nothing_correlates_are_as_short_as_they_may_be() -> None:
    """And a channel that was not measured makes them no longer."""
    white = np.random.default_rng(2).standard_normal((8000, 2)) * [1.0, 0.0]
    assert block_time([white, white[:3000]], [1e-3, 1e-3], 0.1) == 0.1


def test_blocks_are_no_longer_than_leaves_some_in_each_experiment() -> None:
    """Of a reading that creeps all the time, ten are left of the shortest experiment."""
    creeping = np.linspace(-1.0, 1.0, 4000)[:, None]
    assert block_time([creeping, creeping[:2000]], [1e-3, 1e-3], 0.1) == pytest.approx(0.2)


def test_experiments_share_their_noise_in_any_order() -> None:
    """Logs of different rates and lengths give the same noise whichever comes first."""
    channels = [
        correlogram(v, np.arange(len(v)) % 7 > 0, 1.0 / rate)
        for rate, length, seed in ((100.0, 60.0, 1), (50.0, 90.0, 2), (200.0, 40.0, 3))
        for v in (ornstein_uhlenbeck(rate, length, seed),)
    ]
    one, other = shared(channels), shared(channels[::-1])
    assert other.density == pytest.approx(one.density, rel=1e-9)
    assert other.sample_size == pytest.approx(one.sample_size, rel=1e-9)
