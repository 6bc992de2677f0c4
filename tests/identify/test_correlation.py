"""How many independent values correlated residuals are worth, at any sample rate."""

import numpy as np
import pytest

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.correlation import Noise, correlogram, shared

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
    found = [noise_of(ornstein_uhlenbeck(rate, 300.0, seed), rate) for seed in range(4)]
    assert np.mean([n.density for n in found]) == pytest.approx(2.0 * TIME_CONSTANT, rel=0.2)
    assert np.mean([n.sample_size for n in found]) == pytest.approx(500.0, rel=0.2)


def test_white_noise_is_worth_every_sample() -> None:
    """Nothing is correlated; every value counts."""
    values = np.random.default_rng(1).standard_normal(20_000)
    assert noise_of(values, 100.0).sample_size == pytest.approx(20_000, rel=0.1)


def test_experiments_share_their_noise_in_any_order() -> None:
    """Logs of different rates and lengths give the same noise whichever comes first."""
    seen = [
        correlogram(v, np.arange(len(v)) % 7 > 0, 1.0 / rate)
        for rate, length, seed in ((100.0, 60.0, 1), (50.0, 90.0, 2), (200.0, 40.0, 3))
        for v in (ornstein_uhlenbeck(rate, length, seed),)
    ]
    one, other = shared(seen), shared(seen[::-1])
    assert other.density == pytest.approx(one.density, rel=1e-9)
    assert other.sample_size == pytest.approx(one.sample_size, rel=1e-9)
