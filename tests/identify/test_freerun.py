"""The free run and its floor: what they mean, seen on machines whose truth is known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hil_emulator.identify.disagreement.freerun import FILTER_SETTLING, RESTART_INTERVAL, replay
from hil_emulator.identify.disagreement.gap import compare, measure
from hil_emulator.identify.disagreement.motion import by_motion
from hil_emulator.identify.estimation.fit import Fit
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant import parameters
from hil_emulator.identify.prediction.residuals.noise import noise_levels
from tests.identify.rig_data import INSTRUMENTS, knee_model, recorded

LEAKAGE = 1e-13
"""Conductance of the leakage that the machine has [m^3/(s*Pa)]."""


@cache
def leaking() -> Experiment:
    """Return an experiment with a leaking cylinder."""
    return recorded({"internal_leakage_conductance": LEAKAGE}, "multisine", 3)


@cache
def observer() -> Observer:
    """Return an observer of a usual rig's channels."""
    return Observer(knee_model(), INSTRUMENTS)


def model(leakage: float) -> Fit:
    """Return a model with the machine's ordinary parameters and some leakage."""
    model = knee_model()
    effects = {c.name: c for c in parameters.candidates(model, INSTRUMENTS)}
    ordinary = {c.name: c for c in parameters.ordinary(model)}
    free = [effects["internal_leakage"], ordinary["valve_gain"], ordinary["oil_bulk_modulus"],
            ordinary["coulomb_friction"]]  # fmt: skip
    values = (leakage, *(f * c.neutral for c, f in zip(free[1:], (1.07, 0.92, 1.2), strict=True)))
    at = np.array([c.at(v) for c, v in zip(free, values, strict=True)])
    return Fit(free, at, np.zeros(0), np.zeros((0, len(free))), 0.0)


def test_the_true_model_reaches_the_floor_and_the_configured_one_does_not() -> None:
    """With its leakage the model leaves what drift and noise leave; without, several times it."""
    compared = compare(observer(), model(0.0), model(LEAKAGE), [leaking()], [])
    for channel in ("pressure_a", "pressure_b", "position"):
        free = measure(observer(), compared)[channel]["training"]
        assert free["free_after"] < 2.0 * free["free_floor"]
        assert free["free_before"] > 2.0 * free["free_after"]
        assert free["after"] < 1.15 * free["floor"]


def test_the_gap_in_percent_is_the_gap_over_the_spread_of_the_channel() -> None:
    """The ratio of both units is noise over spread."""
    e, predictor = leaking(), observer()
    entry = measure(predictor, compare(predictor, model(0.0), model(0.0), [e], []))["position"][
        "training"
    ]
    noise = noise_levels(e, INSTRUMENTS)[INSTRUMENTS.index("position")]
    percent = 100.0 * entry["free_before"] * noise / np.std(e.readings["position"])
    assert entry["free_before_percent"] == pytest.approx(percent, rel=1e-9)


def test_nothing_corrects_the_free_run_between_two_restarts() -> None:
    """Readings inside a window do not change the prediction there; those before it do."""
    e = leaking()
    par, chan = knee_model().memory(model(LEAKAGE).coordinates, model(LEAKAGE).at)
    frozen = observer().freeze(e, par, chan)
    plain = replay(observer(), frozen, par, chan)
    begin = round((FILTER_SETTLING + RESTART_INTERVAL) / e.period)
    moved = frozen.data.measured.copy()
    moved[begin + 1 : begin + 400, 0] += 5e5
    changed = replace(frozen, data=frozen.data._replace(measured=moved))
    other = replay(observer(), changed, par, chan)
    inside = slice(begin + 1, begin + round(RESTART_INTERVAL / e.period) + 1)
    predicted = [f.data.measured - r.free for f, r in ((frozen, plain), (changed, other))]
    np.testing.assert_allclose(predicted[0][inside], predicted[1][inside], rtol=0, atol=1e-6)
    assert plain.age[inside].tolist() == list(range(1, round(RESTART_INTERVAL / e.period) + 1))
    assert not np.allclose(plain.one_step[inside], other.one_step[inside], equal_nan=True)


def test_the_error_of_the_free_run_grows_with_time_since_the_restart() -> None:
    """A wrong model is as good as its state at first, and then runs away."""
    e = leaking()
    par, chan = knee_model().memory(model(0.0).coordinates, model(0.0).at)
    run = replay(observer(), observer().freeze(e, par, chan), par, chan)
    position = run.free[:, INSTRUMENTS.index("position")]
    early, late = (np.mean(position[(run.age > a) & (run.age <= b)] ** 2)
                   for a, b in ((0, 20), (300, 500)))  # fmt: skip
    assert late > 4.0 * early


def test_missing_readings_count_for_nothing() -> None:
    """A hole in a channel leaves every number finite."""
    e = leaking()
    holed = e.readings["pressure_a"].copy()
    holed[800:1000] = np.nan
    e = replace(e, readings=e.readings | {"pressure_a": holed})
    gap = measure(observer(), compare(observer(), model(0.0), model(LEAKAGE), [e], []))
    assert all(np.isfinite(v) for parts in gap.values() for v in parts["training"].values())


def test_regions_of_motion_share_the_samples_among_them() -> None:
    """Every sample lies in one region, so the mean square over all is theirs, weighted."""
    predictor = observer()
    compared = compare(predictor, model(0.0), model(LEAKAGE), [leaking()], [])
    whole = measure(predictor, compared)["pressure_b"]["training"]["free_before"]
    parts = [v["before"] for v in by_motion(predictor, compared)["pressure_b"].values()]
    assert min(parts) < whole < max(parts)
    assert len(parts) == 5


def test_an_error_in_si_is_its_multiple_of_the_noise_times_the_noise() -> None:
    """With one experiment that holds in all, and in each region of motion."""
    predictor = observer()
    compared = compare(predictor, model(0.0), model(LEAKAGE), [leaking()], [])
    noise = dict(zip(predictor.channels, compared.after["training"][0].noise, strict=True))
    entries = [
        (c, parts["training"], f"free_{when}")
        for c, parts in measure(predictor, compared).items()
        for when in ("before", "floor")
    ]
    entries += [(c, errors, when) for c, parts in by_motion(predictor, compared).items()
                for errors in parts.values() for when in ("before", "after", "floor")]  # fmt: skip
    for channel, errors, when in entries:
        assert errors[f"{when}_rms"] == pytest.approx(errors[when] * noise[channel])


def test_a_short_experiment_has_no_free_run_and_no_harm() -> None:
    """A fifth of a second is over before the filter knows the null: only one step is measured."""
    e = leaking()
    part = {name: values[:200] for name, values in e.readings.items()}
    short = replace(e, readings=part, current=e.current[:200])
    predictor = observer()
    gap = measure(predictor, compare(predictor, model(0.0), model(LEAKAGE), [short], []))
    assert np.isfinite(gap["position"]["training"]["before"])
    assert "free_before" not in gap["position"]["training"]
