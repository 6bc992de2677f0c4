"""Cluster-robust variance of residuals that are correlated in time and by place of the stroke."""

import numpy as np
import pytest

from hil_emulator.identify.estimation.clusters import PLACES, Clusters, places_of
from hil_emulator.identify.measured.experiment import Array, Experiment

PERIOD = 1e-3
SAMPLES = 2500
BLOCK = 100
WAY = 0.08
GROOVES = 2.6e-3
"""Wavelength of the friction's ripple [m]."""


def strokes() -> list[Experiment]:
    """Return four experiments in which a rod goes to and fro at different rates."""
    time = PERIOD * np.arange(SAMPLES)
    ways = [0.5 * WAY * (1.0 - np.cos(2.0 * np.pi * rate * time)) for rate in (0.9, 1.3, 1.7, 2.3)]
    return [Experiment(f"{i}", PERIOD, np.zeros(SAMPLES), {"position": x})
            for i, x in enumerate(ways)]  # fmt: skip


def clusters(places: bool) -> Clusters:
    """Return what may be correlated among the residuals of one channel."""
    places_there = np.concatenate(places_of(strokes())) if places else np.zeros(0, np.int64)
    return Clusters(BLOCK, places_there)


def rippling(random: np.random.Generator, position: Array) -> Array:
    """Return white noise with a ripple along the stroke, in any phase."""
    phase = random.uniform(0.0, 2.0 * np.pi)
    return random.standard_normal(len(position)) + np.sin(2.0 * np.pi * position / GROOVES + phase)


@pytest.mark.parametrize(("places", "low", "high"), [(True, 0.6, 3.0), (False, 0.0, 0.3)])
def test_clusters_by_place_give_the_variance_with_ripple(
    places: bool, low: float, high: float
) -> None:
    """Clusters by place give the variance of an estimate over many machines.

    Clusters by time alone give less than a third of it.
    """
    random, which = np.random.default_rng(7), clusters(places)
    position = np.concatenate([e.readings["position"] for e in strokes()])
    grains = (position / WAY * 99.0).astype(int)
    happened, variances = [], []
    for _ in range(300):
        column, noise = random.standard_normal(100)[grains], rippling(random, position)
        size = float(column @ noise) / float(column @ column)
        happened.append(size**2)
        factor = which.variance_factor(column, noise - size * column)
        variances.append(factor / float(column @ column))
    assert low < float(np.mean(variances) / np.mean(happened)) < high


def test_white_noise_has_a_variance_factor_near_one() -> None:
    """With white noise neither grouping increases the variance much."""
    random = np.random.default_rng(8)
    column = np.sin(0.05 * np.arange(4 * SAMPLES))
    factors = [clusters(places=True).variance_factor(column, random.standard_normal(len(column)))
             for _ in range(50)]  # fmt: skip
    assert 1.0 <= np.median(factors) < 1.3


def test_clusters_by_place_do_not_reduce_the_variance() -> None:
    """The factor with both groupings is at least that with groups by time."""
    random = np.random.default_rng(9)
    slow = np.repeat(random.standard_normal(4 * SAMPLES // BLOCK), BLOCK)
    column = np.ones(len(slow))
    by_time, by_both = (clusters(p).variance_factor(column, slow) for p in (False, True))
    assert 0.5 * BLOCK < by_time <= by_both


def test_without_a_reading_the_place_is_unknown() -> None:
    """Samples without a position belong to no place; both directions share the places."""
    there, back = np.linspace(0.0, WAY, SAMPLES), np.linspace(WAY, 0.0, SAMPLES)
    there[10] = np.nan
    logs = [Experiment("there", PERIOD, there, {"position": there}),
            Experiment("back", PERIOD, back, {"position": back}),
            Experiment("blind", PERIOD, back, {"load_force": back})]  # fmt: skip
    one, other, no_places = places_of(logs)
    assert one[10] == -1
    assert (no_places == -1).all()
    assert set(one[one >= 0]) == set(other) == set(range(PLACES))


def test_a_rod_that_rests_has_no_places() -> None:
    """A constant position gives groups by time only."""
    at_rest = [Experiment("rest", PERIOD, np.zeros(SAMPLES), {"position": np.full(SAMPLES, 0.02)})]
    assert (places_of(at_rest)[0] == -1).all()
