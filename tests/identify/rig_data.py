"""Experiments made with the emulator's own plant: closed loop, drifting null, noisy sensors."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from hil_emulator.config.load import Configuration, load
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.platform.paths import cache_folder

CACHE = cache_folder()
KNEE = Path(__file__).parents[2] / "configs" / "hyq_knee.toml"
PERIOD = 1e-3
INSTRUMENTS = ("pressure_a", "pressure_b", "supply_pressure", "position", "load_force")
"""Channels of a usual rig, without velocity and spool position."""
OFF = {"valve_gain": 1.07, "oil_bulk_modulus": 0.92, "coulomb_friction_force": 1.2}
"""Ordinary parameters of the machine over those in its data sheets."""


@cache
def knee() -> Configuration:
    """Return the reference machine."""
    return load([KNEE])


@cache
def knee_model() -> PlantModel:
    """Return the reference machine, compiled once."""
    return PlantModel(knee(), CACHE)


def reference(kind: str, time: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a wanted position over time [m]."""
    if kind == "steps":
        levels = random.uniform(-0.012, 0.012, 20)
        return 0.04 + levels[(time / 0.35).astype(int) % 20]
    if kind == "triangles":
        return 0.04 + 0.01 * (2.0 * np.abs(2.0 * (time / 1.0 % 1.0) - 1.0) - 1.0)
    frequencies = np.array([0.7, 1.3, 2.9, 5.3, 9.7, 17.0, 31.0])
    sizes = np.array([6.0, 5.0, 4.0, 2.0, 1.0, 0.6, 0.3]) * 1e-3
    phases = random.uniform(0.0, 2.0 * np.pi, len(sizes))
    waves = np.sin(2.0 * np.pi * np.outer(time, frequencies) + phases) - np.sin(phases)
    return 0.04 + waves @ sizes * np.minimum(1.0, time / 0.3)


def recorded(
    changes: Mapping[str, float], kind: str, seed: int, duration: float = 2.0,
    sensors: Mapping[str, Mapping[str, float]] | None = None, ticks: int = 1,
) -> Experiment:  # fmt: skip
    """Drive the plant with changed parameters along a reference and record it.

    The controller sets the current every few ticks; a row is written at every tick.
    """
    model, config = knee_model(), knee()
    random = np.random.default_rng(seed)
    values = dict(model.plant_values)
    for name, factor in OFF.items():
        values[name] *= factor
    plant = Plant(model.kernel, values | dict(changes), 2e-5)
    chain = {n: dict(config.sensors.get(n, {})) | dict((sensors or {}).get(n, {}))
             for n in model.names}  # fmt: skip
    readings = Sensors(model.kernel, chain, PERIOD, random)
    time = np.arange(round(duration / PERIOD)) * PERIOD
    wanted = reference(kind, time, random)
    current, drift = np.zeros(len(time)), 0.0
    table = np.zeros((len(time), len(readings.names)))
    keep = np.exp(-PERIOD / 4.0)
    for k in range(len(time)):
        readings.sample(plant.signal_vector, plant.path)
        table[k] = readings.reading
        drift = drift * keep + 1e-5 * np.sqrt(1.0 - keep**2) * random.standard_normal()
        current[k] = current[k - 1]
        if k % ticks == 0:
            current[k] = np.clip(0.45 * (wanted[k] - table[k, 3]), -6e-3, 6e-3)
        plant.command({"valve_current": current[k] + drift})
        plant.step(50)
    channels = {n: table[:, readings.names.index(n)].copy() for n in INSTRUMENTS}
    return Experiment(f"{kind}-{seed}", PERIOD, current, channels)


def campaign(
    changes: Mapping[str, float], seed: int = 1,
    sensors: Mapping[str, Mapping[str, float]] | None = None, ticks: int = 1,
) -> tuple[list[Experiment], list[Experiment]]:  # fmt: skip
    """Return training and validation experiments of one machine."""
    kinds = ("multisine", "steps", "triangles")
    train = [recorded(changes, kind, seed + i, sensors=sensors, ticks=ticks)
             for i, kind in enumerate(kinds)]  # fmt: skip
    other = [recorded(changes, kind, seed + 100 + i, sensors=sensors, ticks=ticks)
             for i, kind in enumerate(("multisine", "steps"))]  # fmt: skip
    return train, other


def thinned(experiment: Experiment, every: int) -> Experiment:
    """Return an experiment of which a logger kept some rows."""
    readings = {n: v[::every].copy() for n, v in experiment.readings.items()}
    current = experiment.current[::every].copy()
    return replace(experiment, period=every * experiment.period, current=current, readings=readings)


def without(experiment: Experiment, *channels: str) -> Experiment:
    """Return an experiment without some channels."""
    kept = {n: v for n, v in experiment.readings.items() if n not in channels}
    return replace(experiment, readings=kept)
