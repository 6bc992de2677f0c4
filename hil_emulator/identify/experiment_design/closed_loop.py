"""Simulation of a machine on a bench: the model in a position loop, with disturbances.

The null of the valve drifts, the supply ripples, and instruments are noisy; the controller uses the
readings. The result has the content of a real bench's log.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hil_emulator.identify.experiment_design.library import Target
from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.plant.rating import largest_current, velocity_gain
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors

BANDWIDTH = 45.0
"""Bandwidth of the position loop if the oil spring permits it [rad/s] (assumed)."""

DAMPED = 0.12
"""Largest bandwidth over the natural frequency of piston and oil (assumed: the gain margin of a
loop around an integrator and a mode damped by a tenth or so)."""

CURRENT_SHARE = 0.7
"""Part of the largest valve current that the controller uses (assumed)."""

FEED_FORWARD = 0.9
"""Part of the current for the target's speed that the controller adds as feed-forward (assumed)."""

HOLD_TIME = 0.3
"""Time for which the rod is held before anything is recorded [s] (assumed)."""


@dataclass(frozen=True)
class Disturbances:
    """Disturbances, which no configuration states.

    Attributes:
        null_drift: standard deviation of the valve's null [A].
        null_time: time constant of its drift [s].
        ripple: amplitude of the supply pressure's ripple [Pa].
        ripple_frequency: [Hz].
        noise: standard deviation of each channel's noise, in its unit.
        coloured: part of the noise's power that is correlated in time.
        resolution: step of each channel's reading, in its unit.

    """

    null_drift: float
    null_time: float = 4.0
    ripple: float = 0.5e5
    ripple_frequency: float = 11.0
    noise: Mapping[str, float] = field(default_factory=dict)
    coloured: float = 0.0
    resolution: Mapping[str, float] = field(default_factory=dict)


CORRELATION = 0.95
"""Correlation of coloured noise from sample to sample (assumed)."""


@dataclass(frozen=True)
class SimulatedBench:
    """A plant with its instruments.

    Attributes:
        model: the compiled model.
        par: parameters of the plant.
        chan: parameters of the transducers.
        world: disturbances.
        instruments: the channels that are recorded.
        step: largest integration step [s].

    """

    model: PlantModel
    par: Array
    chan: Array
    world: Disturbances
    instruments: tuple[str, ...]
    step: float

    def record(self, target: Target, seed: int, name: str = "") -> Experiment:
        """Play an experiment in closed loop and return the recording."""
        period = float(target.time[1] - target.time[0])
        random = np.random.default_rng(seed)
        wanted, feed, begin = self._asked(target, period)
        count = len(wanted)
        plant, sensors = self._assembled(period, random)
        supply = self._supply(2 * count, 0.5 * period, random)
        drift = self._drift(count, period, random)
        noise = self._noise(count, random)
        gain, top = self._gain(), CURRENT_SHARE * largest_current(self.model.plant_values)
        at = self.model.names.index("position")
        steps = math.ceil(period / self.step - 1e-9)
        plant.step_width = period / steps
        table, current = np.empty((count, len(self.model.names))), np.empty(count)
        read = list(self.model.signal_names).index("supply_pressure")
        for k in range(count):
            # the mean ripple of a sample is its value half a sample later
            plant.signal_vector[read] += supply[2 * k] - plant.parameter_vector[self.model.supply]
            sensors.sample(plant.signal_vector, plant.path)
            table[k] = self._rounded(sensors.reading + noise[k])
            current[k] = np.clip(gain * (wanted[k] - table[k, at]) + feed[k], -top, top)
            plant.parameter_vector[self.model.supply] = supply[2 * k + 1]
            plant.command({"valve_current": float(current[k] + drift[k])})
            plant.step(steps)
        channels = {n: table[begin:, self.model.names.index(n)].copy() for n in self.instruments}
        return Experiment(name or target.stimulus.name, period, current[begin:].copy(), channels)

    def _asked(self, target: Target, period: float) -> tuple[Array, Array, int]:
        """Return target and feed-forward current after a rest, and the length of the rest."""
        begin = round(HOLD_TIME / period)
        wanted = np.concatenate([np.full(begin, target.position[0]), target.position])
        feed = np.gradient(wanted, period) * FEED_FORWARD / velocity_gain(self.model.plant_values)
        return wanted, np.asarray(0.0 * feed if target.stimulus.jumps else feed), begin

    def _assembled(self, period: float, random: np.random.Generator) -> tuple[Plant, Sensors]:
        names = list(self.model.kernel.parameters.names or ())
        plant = Plant(
            self.model.kernel, dict(zip(names, self.par.tolist(), strict=True)), self.step
        )
        sensors = Sensors(self.model.kernel, {}, period, random)
        sensors.parameters[:] = self.chan
        return plant, sensors

    def _gain(self) -> float:
        """Return the controller's gain [A/m]."""
        p = self.model.plant_values
        area, alpha, x = p["cylinder_piston_area"], p["cylinder_area_ratio"], p["cylinder_stroke"]
        a = p["cylinder_dead_volume_a"] + 0.5 * area * x
        b = p["cylinder_dead_volume_b"] + 0.5 * alpha * area * x
        spring = p["oil_bulk_modulus"] * area**2 * (1.0 / a + alpha**2 / b)
        natural = math.sqrt(spring / p["load_mass"])
        return min(BANDWIDTH, DAMPED * natural) / velocity_gain(p)

    def _supply(self, count: int, period: float, random: np.random.Generator) -> Array:
        w = 2.0 * math.pi * self.world.ripple_frequency
        wave = np.sin(w * period * np.arange(count) + random.uniform(0.0, 2.0 * math.pi))
        return np.asarray(self.par[self.model.supply] + self.world.ripple * wave)

    def _drift(self, count: int, period: float, random: np.random.Generator) -> Array:
        keep = math.exp(-period / self.world.null_time)
        return self.world.null_drift * _correlated(random.standard_normal((count, 1)), keep)[:, 0]

    def _noise(self, count: int, random: np.random.Generator) -> Array:
        white = random.standard_normal((count, len(self.model.names)))
        slow = _correlated(random.standard_normal(white.shape), CORRELATION)
        size = np.array([self.world.noise.get(n, 0.0) for n in self.model.names])
        share = self.world.coloured
        return np.asarray(size * (math.sqrt(1.0 - share) * white + math.sqrt(share) * slow))

    def _rounded(self, reading: Array) -> Array:
        steps = np.array([self.world.resolution.get(n, 0.0) for n in self.model.names])
        return np.where(steps > 0.0, np.round(reading / np.maximum(steps, 1e-30)) * steps, reading)


def _correlated(white: Array, keep: float) -> Array:
    """Return unit white noise with a correlation from row to row, still of unit variance."""
    out = np.empty_like(white)
    out[0] = white[0]
    fresh = math.sqrt(1.0 - keep * keep)
    for k in range(1, len(white)):
        out[k] = keep * out[k - 1] + fresh * white[k]
    return out
