"""The library of experiments: what a machine allows, and what it is asked for."""

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.errors import UserError
from hil_emulator.identify.experiment_design.closed_loop import Disturbances, SimulatedBench
from hil_emulator.identify.experiment_design.library import (
    LIBRARY,
    Limits,
    Stimulus,
    limits,
    stimulus,
    target,
)
from hil_emulator.identify.prediction.plant.rating import velocity_gain
from hil_emulator.platform.paths import shipped
from tests.identify.rig_data import INSTRUMENTS, knee, knee_model

EVERY = pytest.mark.parametrize("entry", LIBRARY, ids=lambda e: e.name)


@EVERY
def test_no_target_meets_a_stop_or_outruns_the_valve(entry: Stimulus) -> None:
    """For any seed: within the stroke, without a jump at the start, below the speed limit."""
    allowed = limits(knee().plant)
    for seed in range(5):
        made = target(entry, allowed, seed=seed)
        assert made.position.min() >= allowed.low - 1e-9
        assert made.position.max() <= allowed.high + 1e-9
        assert made.position[0] == pytest.approx(allowed.start, abs=1e-6)
        speed = np.abs(np.diff(made.position)) / 1e-3
        assert entry.jumps or speed.max() <= allowed.speed * (1.0 + 1e-6)


@EVERY
def test_a_slow_machine_gets_a_smaller_experiment(entry: Stimulus) -> None:
    """With a tenth of the speed, a fast target shrinks until the valve can follow."""
    slow = Limits(0.04, 0.004, 0.076, 0.05)
    made = target(entry, slow)
    assert entry.jumps or np.abs(np.diff(made.position)).max() <= 0.05e-3 * (1.0 + 1e-6)


@EVERY
def test_the_amplitude_is_the_largest_deviation(entry: Stimulus) -> None:
    """`--amplitude` is the largest distance from the centre, for any seed."""
    made = target(entry, limits(knee().plant), amplitude=1e-3, seed=3)
    assert np.abs(made.position - 0.04).max() == pytest.approx(1e-3, rel=0.02)
    again = target(entry, limits(knee().plant), amplitude=1e-3, seed=3)
    assert np.array_equal(made.position, again.position)


def test_a_rod_that_starts_near_a_stop_is_moved_away_gently() -> None:
    """A central experiment approaches the middle of the stroke below 1 m/s and uses all of it."""
    made = target(stimulus("stroke"), Limits(0.01, 0.004, 0.076, 0.5))
    assert made.position[0] == pytest.approx(0.01)
    assert made.position.max() > 0.07
    assert np.abs(np.diff(made.position)).max() < 1e-3


@pytest.mark.parametrize(
    ("amplitude", "duration", "message"),
    [(0.05, None, "at most 36 mm"), (-1e-3, None, "does not fit"), (None, 0.1, "too short")],
)
def test_what_cannot_be_done_is_refused(
    amplitude: float | None, duration: float | None, message: str
) -> None:
    """An amplitude beyond the stroke and a duration of nothing end in a message."""
    with pytest.raises(UserError, match=message):
        target(stimulus("steps"), limits(knee().plant), amplitude, duration)


def test_an_unknown_experiment_is_refused_with_those_there_are() -> None:
    """A misspelt name lists the library."""
    with pytest.raises(UserError, match=r"no such experiment.* multisine"):
        stimulus("multisin")


def test_the_velocity_gain_is_that_of_the_model() -> None:
    """A small current moves the unloaded rod at the formula's speed, within a tenth."""
    free = load([shipped("configs/hyq_knee.toml")]).plant | {
        "viscous_friction_coefficient": 0.0, "coulomb_friction_force": 0.0,
        "load_viscous_friction_coefficient": 0.0,
    }  # fmt: skip
    from hil_emulator.model.plant import Plant

    plant = Plant(knee_model().kernel, free, 2e-5)
    plant.command({"valve_current": 1e-3})
    plant.step(7500)
    assert plant.signals.velocity == pytest.approx(1e-3 * velocity_gain(free), rel=0.1)


@EVERY
def test_the_rod_follows_in_closed_loop(entry: Stimulus) -> None:
    """On the reference machine the loop is stable: the rod stays within the moved range."""
    model = knee_model()
    machine = SimulatedBench(model, model.par, model.chan, Disturbances(1e-5), INSTRUMENTS, 2.5e-4)
    made = target(entry, limits(model.plant_values))
    recorded = machine.record(made, 1)
    position = recorded.readings["position"]
    assert len(position) == len(made.time) == len(recorded.current)
    assert position.min() > made.position.min() - 2e-3
    assert position.max() < made.position.max() + 2e-3
    if not entry.jumps:
        assert np.std(position - made.position) < 0.15 * np.ptp(made.position)
