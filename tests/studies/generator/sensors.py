"""From the true quantities to readings: errors of sensors in two laws, noise, converter."""

import numpy as np
from scipy.signal import cont2discrete, lfilter

Array = np.ndarray

CHANNELS = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")


def noise(samples: int, coloured: bool, random: np.random.Generator) -> Array:
    """Return noise of unit variance, shape (samples, channels).

    Coloured: half its power with a pole at 0.95.
    """
    white = random.standard_normal((samples, len(CHANNELS)))
    if not coloured:
        return white
    slow = lfilter([np.sqrt(1.0 - 0.95**2)], [1.0, -0.95],
                   random.standard_normal(white.shape), axis=0)  # fmt: skip
    return np.sqrt(0.5) * (white + slow)


def three_lags(time: float) -> tuple[list[float], Array]:
    """Return numerator and denominator of three equal lags that are late by a time together [s]."""
    return [1.0], np.poly1d([time / 3.0, 1.0]) ** 3


def late(values: Array, time: float, period: float, foreign: bool) -> Array:
    """Return a channel that is read late; foreign: three equal lags instead of a dead time."""
    if not foreign:
        steps = np.arange(len(values))
        return np.interp(steps - time / period, steps, values)
    numerator, denominator, _ = cont2discrete(three_lags(time), period, "foh")
    return lfilter(numerator[0], denominator, values - values[0]) + values[0]


def ringing(values: Array, time: float, period: float) -> Array:
    """Return a pressure at the end of a line: resonance with a tenth of critical damping."""
    pole = np.exp(period / time * complex(-0.1, np.sqrt(0.99)))
    denominator = [1.0, -2.0 * pole.real, abs(pole) ** 2]
    return lfilter([sum(denominator)], denominator, values - values[0]) + values[0]


def transduced(
    table: Array, effects: dict[str, float], foreign: bool, period: float, bends: float,
    since: float = 0.0,
) -> Array:  # fmt: skip
    """Return what the sensors report, without noise.

    Foreign: offsets and a gain that have wandered for a while [s], a load cell whose gain bends at
    some force [N].
    """
    size, out = effects.get, table.copy()
    time = since + np.arange(len(table)) * period
    wander = 1.0 + (0.5 * np.sin(1.3 * time) if foreign else 0.0)
    force = bends * np.tanh(table[:, 4] / bends) if foreign else table[:, 4]
    out[:, 0] += size("pressure_a.offset", 0.0) * wander
    out[:, 1] += size("pressure_b.gain_error", 0.0) * table[:, 1] * wander
    out[:, 4] += size("load_force.gain_error", 0.0) * force
    out[:, 4] += size("load_force.offset", 0.0) * wander
    out[:, 4] += size("cell_crosstalk", 0.0) * (table[:, 0] + table[:, 1])
    if "position.delay" in effects:
        out[:, 3] = late(table[:, 3], effects["position.delay"], period, foreign)
    if "tap_resonance" in effects:
        out[:, 0] = ringing(out[:, 0], effects["tap_resonance"], period)
    return out


def converted(readings: Array, steps: Array) -> Array:
    """Return readings in whole steps of the converter."""
    return np.round(readings / steps) * steps
