"""The baselines are no straw men: where they may work, they do."""

from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from tests.identify.rig_data import knee_model
from tests.studies.baselines.replay import CHANNELS, Replay, Way
from tests.studies.baselines.selection import by_bic, by_thresholds
from tests.studies.generator.cases import Case, campaign

LEAK = 3e-13
WAYS: tuple[Way, ...] = ("open loop", "multiple shooting", "equation error")


@cache
def recordings(leak: float) -> tuple[Experiment, ...]:
    """Return short recordings of the blind plant with a large leak."""
    leaky = Case("medium-00", {"internal_leakage": leak} if leak else {}, False, False, 0.6)
    return tuple(campaign(leaky)[0])


def chosen(*names: str) -> list[Coordinate]:
    """Return some candidates."""
    return [c for c in parameters.candidates(knee_model(), CHANNELS) if c.name in names]


@pytest.mark.full(sibling="test_a_large_leak_is_found_by_sparse_regression")
@pytest.mark.parametrize("way", WAYS)
def test_a_large_leak_is_found_by_bic(way: Way) -> None:
    """It comes first among a few candidates, within a third of its size."""
    replay = Replay(knee_model(), recordings(LEAK), way)
    candidates = chosen("internal_leakage", "gravity", "load_force.gain_error")
    model, named = by_bic(replay, parameters.ordinary(knee_model()), candidates)
    assert named[0].name == "internal_leakage"
    value = named[0].value(model.at[[c.name for c in model.free].index("internal_leakage")])
    assert value == pytest.approx(LEAK, rel=0.33)


@pytest.mark.slow
def test_a_large_leak_is_found_by_sparse_regression() -> None:
    """It is among the terms that the regression keeps."""
    replay = Replay(knee_model(), recordings(LEAK), "equation error")
    candidates = chosen("internal_leakage", "gravity", "load_force.gain_error")
    _, kept = by_thresholds(replay, parameters.ordinary(knee_model()), candidates)
    assert "internal_leakage" in [c.name for c, _ in kept]


def test_shorter_stretches_drift_less() -> None:
    """The position runs away in open loop, less in 200 ms, and not at all within a sample."""
    ways = [Replay(knee_model(), recordings(0.0), way) for way in WAYS]
    nuisances = parameters.ordinary(knee_model())
    at = np.zeros(len(nuisances))
    drift = [float(np.std(replay.residual(nuisances, at)[:, 3])) for replay in ways]
    assert drift[0] > 2.0 * drift[1] > 10.0 * drift[2]
