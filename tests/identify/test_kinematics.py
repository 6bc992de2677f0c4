"""Velocity and acceleration of a rod from its position, against motions known in closed form."""

import numpy as np
import pytest

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.benches.kinematics import motion, resolution

PERIOD = 1e-3


def moved(phase: float, duration: float = 8.0) -> tuple[Array, Array, Array]:
    """Return position, velocity and acceleration of a rod that goes to and fro.

    Each stroke begins and ends with an acceleration of a given time that follows sin^2, and is
    steady in between.
    """
    time = np.arange(round(duration / PERIOD)) * PERIOD
    top, stroke = 0.1, 0.6
    x, v, a = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
    for k in range(int(duration / stroke) + 1):
        change = (top if k == 0 else 2.0 * top) * (-1.0) ** k
        s = np.clip((time - k * stroke) / phase, 0.0, 1.0)
        inside = (s > 0.0) & (s < 1.0)
        a += np.where(inside, change * 2.0 / phase * np.sin(np.pi * s) ** 2, 0.0)
        v += change * (s - np.sin(2.0 * np.pi * s) / (2.0 * np.pi))
        whole = s**2 / 2.0 + (np.cos(2.0 * np.pi * s) - 1.0) / (4.0 * np.pi**2)
        x += change * (phase * whole + np.maximum(time - k * stroke - phase, 0.0))
    return x, v, a


@pytest.mark.parametrize(("phase", "most"), [(0.02, 1.02), (0.06, 1.01), (0.2, 1.01)])
def test_force_errors_are_those_of_exact_derivatives(phase: float, most: float) -> None:
    """With position in steps of 1 um, a load cell of 10 N noise fits 95 kg as with exact motion."""
    x, v, a = moved(phase)
    random = np.random.default_rng(1)
    force = 95.0 * a + 60.0 * np.sign(v) + 200.0 * v
    sliding = np.abs(v) > 0.02
    measured = force + 10.0 * random.standard_normal(len(force))
    estimate = motion(np.round(x / 1e-6) * 1e-6, PERIOD)

    def error(velocity: Array, acceleration: Array) -> tuple[float, Array]:
        rows = np.column_stack([acceleration, np.sign(velocity), velocity])[sliding]
        fitted = np.linalg.lstsq(rows, measured[sliding], rcond=None)[0]
        return float(np.std(measured[sliding] - rows @ fitted)), fitted

    exact, _ = error(v, a)
    smoothed, values = error(estimate.states[:, 1], estimate.states[:, 2])
    assert smoothed < most * exact
    assert values[0] == pytest.approx(95.0, rel=0.01)
    assert values[1] == pytest.approx(60.0, rel=0.08)


@pytest.mark.parametrize("rate", [50, 200, 1000, 5000])
def test_noise_is_found_at_any_rate(rate: int) -> None:
    """The noise of a slow sine is found whatever the rate, and the speed within 5 %."""
    time = np.arange(20 * rate) / rate
    noise = 2e-5 * np.random.default_rng(2).standard_normal(len(time))
    estimate = motion(0.01 * np.sin(2.0 * time) + noise, 1.0 / rate)
    assert estimate.noise == pytest.approx(2e-5, rel=0.15)
    off = estimate.states[:, 1] - 0.02 * np.cos(2.0 * time)
    assert np.std(off) < 0.05 * 0.02


def test_missing_samples_are_bridged() -> None:
    """Where a tenth of the samples is missing, and 50 in a row, speed is as before."""
    x, v, _ = moved(0.2)
    lost = np.random.default_rng(3).random(len(x)) < 0.1
    lost[1000:1050] = True
    estimate = motion(np.where(lost, np.nan, np.round(x / 1e-6) * 1e-6), PERIOD)
    assert np.std(estimate.states[:, 1] - v) < 2e-3 * np.max(np.abs(v))


def test_rounding_is_noise() -> None:
    """A position in steps has at least the noise of rounding, a step over root twelve."""
    x = moved(0.2)[0]
    rounded = np.round(x / 1e-5) * 1e-5
    assert resolution(rounded) == pytest.approx(1e-5, rel=1e-6)
    assert 1e-5 / np.sqrt(12.0) <= motion(rounded, PERIOD).noise * 1.001
