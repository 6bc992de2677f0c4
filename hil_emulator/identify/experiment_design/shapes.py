"""Shapes of experiments: functions of time without a unit, between -1 and 1, zero at the start."""

import math
from collections.abc import Callable

import numpy as np

from hil_emulator.identify.measured.experiment import Array

ENTRY = 0.4
"""Time in which a target leaves its start [s], so that it begins without a jump."""

Shape = Callable[[Array, np.random.Generator], Array]


def smooth(time: Array) -> Array:
    """Return a half cosine from 0 to 1 over `ENTRY`."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(time / ENTRY, 0.0, 1.0)))


def _sines(frequencies: Array, time: Array, random: np.random.Generator) -> Array:
    """Return sines of equal speed in random phases, zero at the start, between -1 and 1."""
    phases = random.uniform(0.0, 2.0 * np.pi, len(frequencies))
    waves = np.sin(2.0 * np.pi * np.outer(time, frequencies) + phases) / frequencies
    sums = (waves.sum(axis=1) - waves[0].sum()) * smooth(time)
    return np.asarray(sums / np.max(np.abs(sums)))


def multisine(time: Array, random: np.random.Generator) -> Array:
    """Return eight sines from 0.6 to 37 Hz, each of the same speed."""
    return _sines(np.geomspace(0.6, 37.0, 8), time, random)


def fast_multisine(time: Array, random: np.random.Generator) -> Array:
    """Return eight sines from 2 to 60 Hz, each of the same speed."""
    return _sines(np.geomspace(2.0, 60.0, 8), time, random)


def steps(time: Array, random: np.random.Generator) -> Array:
    """Return random levels, each held for 0.3 s."""
    return _held(time, 0.3, lambda n: random.uniform(-1.0, 1.0, n))


def pseudo_random(time: Array, random: np.random.Generator) -> Array:
    """Return jumps between two levels at random multiples of 60 ms."""
    return _held(time, 0.06, lambda n: random.choice([-1.0, 1.0], n))


def _held(time: Array, hold: float, draw: Callable[[int], Array]) -> Array:
    """Return held levels after a first level of zero."""
    at = (time / hold).astype(int)
    levels = np.concatenate([[0.0], draw(int(at[-1]) + 1)])
    return np.asarray(levels[at] / max(float(np.max(np.abs(levels[at]))), 1e-9))


def triangles(time: Array, random: np.random.Generator) -> Array:
    """Return ramps to and fro with a period of 1 s: constant speed and sharp reversals."""
    return _ramps(time, 1.0)


def stroke(time: Array, random: np.random.Generator) -> Array:
    """Return one slow ramp to and fro over the whole duration."""
    return _ramps(time, float(time[-1]) + float(time[1]))


def _ramps(time: Array, period: float) -> Array:
    phase = (time / period + 0.25) % 1.0
    return np.asarray(1.0 - 4.0 * np.abs(phase - 0.5))


def chirp(time: Array, random: np.random.Generator) -> Array:
    """Return a sine that rises from 2 to 40 Hz with a falling amplitude: the same speed."""
    end = float(time[-1])
    rate = math.log(40.0 / 2.0) / end
    phase = 2.0 * np.pi * 2.0 * np.expm1(rate * time) / rate
    wave = np.sin(phase) * np.exp(-rate * time)
    return np.asarray(wave / np.max(np.abs(wave)))


def micro_motion(time: Array, random: np.random.Generator) -> Array:
    """Return slow sines within one millimetre."""
    return _sines(np.array([0.7, 1.9, 3.1]), time, random)


def ramp_and_hold(time: Array, random: np.random.Generator) -> Array:
    """Return slow ramps between random levels, each followed by a rest of 0.3 s."""
    ends = np.arange(0.0, float(time[-1]) + 1.2, 0.6)
    levels = np.concatenate([[0.0], random.uniform(-1.0, 1.0, len(ends) - 1)])
    knots = np.concatenate([[0.0], np.column_stack([ends[:-1] + 0.3, ends[1:]]).ravel()])
    values = np.concatenate([[0.0], np.repeat(levels[1:], 2)])
    return np.asarray(np.interp(time, knots, values / max(float(np.max(np.abs(values))), 1e-9)))
