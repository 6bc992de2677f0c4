"""Data that cannot be examined get a verdict with the reason, no crash and no name."""

from dataclasses import replace

import numpy as np
import pytest

import hil_emulator as hil
from hil_emulator.api.reading import as_experiments
from hil_emulator.identify.data_checks.consistency import without_contradictions
from hil_emulator.identify.data_checks.magnitudes import impossible
from hil_emulator.identify.data_checks.plausible import contradictions
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.session import identify
from tests.identify.rig_data import CACHE, knee, knee_model, recorded

TIME = np.arange(1000) * 1e-3
WAVE = np.sin(2.0 * np.pi * 1.5 * TIME)
SPEED = np.cos(2.0 * np.pi * 1.5 * TIME)


def log(period: float = 1e-3, driven: bool = True, **readings: np.ndarray) -> Experiment:
    """Return a plausible experiment with some channels replaced."""
    channels = {
        "position": 0.04 + 0.01 * WAVE,
        "pressure_a": 6e6 + 1e5 * WAVE,
        "pressure_b": 1e7 - 1e5 * WAVE,
    } | readings
    current = 1e-3 * SPEED if driven else np.zeros(0)
    return Experiment("log", period, current, {n: v for n, v in channels.items() if len(v)})


@pytest.mark.parametrize(
    ("experiment", "words"),
    [
        (log(position=np.full(1000, 0.04) + 1e-6 * WAVE), "hardly moves"),
        (log(position=np.zeros(0)), "no experiment shows a moving position"),
        (log(period=0.1), "sampled every 100 ms"),
        (log(position=0.04 - 0.01 * WAVE), "reverse the sign"),
        (log(driven=False), "no balance can be examined"),
    ],
)
def test_data_that_cannot_be_examined_get_the_reason(experiment: Experiment, words: str) -> None:
    """A still rod, a missing position, a slow log, a wrong sign, missing channels."""
    result = identify(knee(), [experiment], cache=CACHE)
    assert result.verdict == "cannot_examine"
    assert words in result.reason
    assert not result.effects


@pytest.mark.parametrize(
    ("lap", "words"), [(0.0, "times as fast as it moves"), (2e-3, "leaves the dead band of ±2 mA")]
)
def test_a_current_within_the_dead_band_is_no_wrong_unit(lap: float, words: str) -> None:
    """A rod that creeps at 2.02 mA: the unit is doubted, unless the valve opens at 2 mA only."""
    creeping = replace(log(position=0.04 + 1e-4 * WAVE), current=2.02e-3 * WAVE)
    (reason,) = impossible([creeping], knee().plant | {"overlap_lap": lap})
    assert words in reason


def test_a_dither_is_averaged_with_a_note() -> None:
    """Without a dither there is no such note."""
    still = log(position=np.full(1000, 0.04) + 1e-6 * WAVE)
    plant = {**knee().plant, "dither_amplitude": 2e-4, "dither_frequency": 150.0}
    trembling = identify(replace(knee(), plant=plant), [still], cache=CACHE)
    assert trembling.notes[0].startswith("the driver's dither of 0.2 mA is averaged")
    assert not any("dither" in note for note in identify(knee(), [still], cache=CACHE).notes)


def test_load_force_against_the_pressures_is_refused() -> None:
    """A load cell of the wrong sign contradicts the chamber pressures."""
    area_a, area_b = 2.0106e-4, 0.61 * 2.0106e-4
    force = area_a * (6e6 + 1e5 * WAVE) - area_b * (1e7 - 1e5 * WAVE)
    result = identify(knee(), [log(load_force=-force)], cache=CACHE)
    assert result.verdict == "cannot_examine"
    assert "load force and pressures are opposite" in result.reason


def test_one_contradictory_log_is_left_out_by_name() -> None:
    """A load cell of the wrong sign in one log of three does not keep the others from use."""
    good = [recorded({}, kind, i) for i, kind in enumerate(("multisine", "steps"))]
    wrong = recorded({}, "triangles", 5)
    wrong = replace(wrong, readings=wrong.readings | {"load_force": -wrong.readings["load_force"]})
    plant = knee_model().plant_values
    sound = without_contradictions([good[0], wrong], [good[1]], plant)
    assert (sound.training, sound.validation) == ([good[0]], [good[1]])
    opposite = "triangles-5: load force and pressures are opposite"
    assert len(sound.left_out) == 1
    assert sound.left_out[0].startswith(f"left out: {opposite}")
    assert sound.contrary == ""


def test_if_all_logs_contradict_physics_the_reason_lists_the_contradictions() -> None:
    """No log is left out if the fit would have no log for the fit; the verdict has the reason."""
    good, wrong = recorded({}, "steps", 1), recorded({}, "triangles", 5)
    wrong = replace(wrong, readings=wrong.readings | {"load_force": -wrong.readings["load_force"]})
    sound = without_contradictions([wrong], [good], knee_model().plant_values)
    assert (sound.training, sound.validation, sound.left_out) == ([wrong], [good], [])
    assert sound.contrary.startswith("triangles-5: load force and pressures are opposite")


def test_a_rod_at_its_stop_may_be_pressed_there() -> None:
    """The stop carries a force that does not reach the load: recordings are not mixed."""
    machine = hil.load("hyq_knee")
    log = machine.simulate(lambda t: 1e-3 * np.sin(2.0 * np.pi * t * (1.0 + t / 6.0)), "6 s")
    assert log["model.stop_force"].abs().max() > 3e3
    assert contradictions(as_experiments(log, 1), knee_model().plant_values) == []
