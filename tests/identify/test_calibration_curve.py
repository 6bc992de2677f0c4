"""A sensor whose calibration curve waves along its range, which is no effect of the catalogue."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil_emulator.config.load import load
from hil_emulator.identify.disagreement.gap import compare, measure
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.estimation.free_terms import score_terms
from hil_emulator.identify.estimation.map_fit import Fitter
from hil_emulator.identify.estimation.projection import Projection
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.reporting.layer import EFFECT_FILE, layer
from hil_emulator.identify.session import Question, identify
from tests.identify.rig_data import CACHE, INSTRUMENTS, KNEE, campaign, knee, knee_model, recorded

WAVES = {
    "pressure_a": (2e5, 100e5), "pressure_b": (2e5, 100e5), "position": (1e-4, 0.01),
    "load_force": (25.0, 1500.0),
}  # fmt: skip
"""Amplitude and length of the wave, by channel: 0.1 to 0.3 % of the usual range, SI (assumed)."""

BALANCES = {
    "pressure_a": "reading of the sensor of pressure a",
    "pressure_b": "reading of the sensor of pressure b",
    "position": "reading of the position sensor", "load_force": "reading of the load cell",
}  # fmt: skip


MEASURED = {
    "pressure_a": "measured pressure a", "pressure_b": "measured pressure b",
    "position": "measured position", "load_force": "measured force",
}  # fmt: skip


def wave(channel: str, values: Array) -> Array:
    """Return by how much a sensor is off at some values."""
    amplitude, length = WAVES[channel]
    return np.asarray(amplitude * np.sin(2.0 * np.pi * values / length))


def misread(experiment: Experiment, channel: str) -> Experiment:
    """Return an experiment whose sensor has a wave in its calibration curve."""
    values = experiment.readings[channel]
    read = values + wave(channel, values)
    return replace(experiment, readings={**experiment.readings, channel: read})


@pytest.mark.parametrize(
    "channel",
    [c if c == "pressure_a" else pytest.param(c, marks=pytest.mark.slow) for c in WAVES],
)
def test_a_waving_calibration_shows_at_its_sensor(channel: str) -> None:
    """Of all free terms that over the sensor's own reading explains the most, with that wave."""
    data = [misread(recorded({}, kind, 3), channel) for kind in ("multisine", "steps")]
    fitter = Fitter(Observer(knee_model(), INSTRUMENTS), data)
    free = parameters.ordinary(knee_model())
    fitter.freeze(free, np.zeros(len(free)))
    fit = fitter.fit(free, np.zeros(len(free)), 3)
    best = score_terms(fitter, free, fit.at, Projection(fit))[0]
    assert best.balance.channel == channel
    assert best.regressor == MEASURED[channel]
    hidden = wave(channel, best.knots)
    assert np.corrcoef(bent(best.knots, best.curve), bent(best.knots, hidden))[0, 1] > 0.9


def bent(values: Array, curve: Array) -> Array:
    """Return a curve without zero and gain: whatever these are, other parameters share them."""
    return np.asarray(curve - np.polyval(np.polyfit(values, curve, 1), values))


@pytest.mark.full(sibling="test_a_waving_calibration_shows_at_its_sensor")
@pytest.mark.parametrize("channel", ["position", "load_force"])
def test_a_waving_calibration_is_reported_as_something_unknown_there(channel: str) -> None:
    """No effect is named, and what is unknown is above all in the reading of that sensor."""
    training, validation = campaign({})
    result = identify(
        knee(), [misread(e, channel) for e in training], [misread(e, channel) for e in validation],
        Question(), cache=CACHE,
    )  # fmt: skip
    assert result.verdict == "unknown_effect"
    assert not result.effects
    assert result.unknown[0].balance == BALANCES[channel]


@pytest.mark.full(sibling="test_a_waving_calibration_shows_at_its_sensor")
@pytest.mark.parametrize("channel", ["position", "load_force"])
def test_a_calibration_that_is_added_closes_the_gap(channel: str, tmp_path: Path) -> None:
    """The emulator with the table misreads as the bench does, on data that took no part."""
    training, validation = ([misread(e, channel) for e in part] for part in campaign({}))
    result = identify(knee(), training, validation, Question(), cache=CACHE)
    assert result.added is not None
    (tmp_path / EFFECT_FILE).write_text(result.added.text)
    (tmp_path / "identified.toml").write_text(layer(result, [KNEE], "2026-01-01"))
    model = PlantModel(load([KNEE, tmp_path / "identified.toml"]), CACHE)
    observer = Observer(model, INSTRUMENTS)
    as_it_is = Fit([], np.zeros(0), np.zeros(0), np.zeros((0, 0)), 0.0)
    gap = measure(observer, compare(observer, as_it_is, as_it_is, training, validation))
    before, after = (g[channel]["validation"] for g in (result.gap, gap))
    floor = before["free_floor"]
    assert after["free_after"] - floor < 0.5 * (before["free_before"] - floor)
