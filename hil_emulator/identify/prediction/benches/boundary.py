"""What holds where a bench ends: what of the actuator it does not have, it replaces by a boundary.

A machine that moves the rod imposes its motion, whatever the force; an absent chamber has no area;
a constant pressure is as good as a channel. Nothing else is assumed about what a configuration need
not describe: it stays "not a number", and so would everything that depended on it.
"""

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.config.bench import BenchSettings
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.position_loop import commanded, found_gain, in_loop
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.layout import fill
from hil_emulator.units import show

LOCKED = 1e12
"""Mass of a load that no actuator moves [kg]: a micrometre per hour at a hundred kilonewton."""

IMPOSED_MOTION = {"load_mass": LOCKED}
"""Whatever moves the rod of a force balance is stronger than it."""

NO_CYLINDER = {"cylinder_piston_area": 0.0, "cylinder_area_ratio": 1.0}

ENDLESS_VOLUME = 1e3
"""Size of a chamber whose pressure no flow of a test changes [m^3]."""

OPEN_PORTS = {
    "load_mass": LOCKED, **NO_CYLINDER, "cylinder_stroke": 1e-3, "initial_position": 0.0,
    "cylinder_dead_volume_a": ENDLESS_VOLUME, "cylinder_dead_volume_b": ENDLESS_VOLUME,
    "oil_bulk_modulus": 1e9,
}  # fmt: skip
"""Of a valve whose ports are at given pressures: whatever oil fills so large a chamber."""

NO_VOLUME = 1e-12
"""Size of a chamber that any flow of a test fills at once [m^3]: edges open by 0.1 uA let through
1e-19 m^3/s per pascal, and within 10 ms it is at the pressure at which its flows balance."""

AT_REST = {
    **OPEN_PORTS, "cylinder_dead_volume_a": NO_VOLUME, "cylinder_dead_volume_b": NO_VOLUME,
    "entrained_air_fraction": 0.0, "valve_natural_frequency": 1e5,
    "driver_lag_time_constant": 0.0, "pilot_lag_time_constant": 0.0,
    "spool_rate_limit_rate": math.inf,
}  # fmt: skip
"""Of a valve in a slow sweep: at rest, neither volumes nor stiffness nor speed have a say; a spool
of 100 kHz stays behind a sweep by less than anybody can measure."""

NO_VALVE = ("force balance", "driven axis")
"""Kinds of bench without a valve."""

_BOUNDARIES: dict[str, dict[str, float]] = {
    "force balance": IMPOSED_MOTION, "driven axis": NO_CYLINDER,
    "valve flow": OPEN_PORTS, "quasi-static sweep": AT_REST, "valve leakage": AT_REST,
}  # fmt: skip


def with_values(model: PlantModel, values: Mapping[str, float]) -> PlantModel:
    """Return the model with other parameters of the plant."""
    other = copy.copy(model)
    other.plant_values = model.plant_values | dict(values)
    other.par = fill(other.kernel.parameters, other.kernel.effects, other.plant_values)
    return other


def bounded(model: PlantModel, bench: BenchSettings) -> PlantModel:
    """Return the model of what stands on a bench."""
    values = dict(_BOUNDARIES.get(bench.kind, {}))
    if math.isnan(bench.chambers.get("pressure_b", 0.0)):
        values["cylinder_area_ratio"] = 0.0
    return with_values(model, values) if values else model


def with_gain(
    bench: BenchSettings, experiments: Sequence[Experiment], plant: Mapping[str, float]
) -> tuple[BenchSettings, list[str]]:
    """Return the bench with the gain that a free loop is found to have, and a note that says so."""
    looped = [e for e in experiments if in_loop(e)]
    if bench.kind != "closed loop" or not math.isnan(bench.proportional_gain) or not looped:
        return bench, []
    gain = found_gain(looped, plant)
    note = f"proportional gain: {show(gain, 'A/m')} fits the configured valve"
    return replace(bench, proportional_gain=gain), [note]


def as_stated(experiments: Sequence[Experiment], bench: BenchSettings) -> list[Experiment]:
    """Return experiments with what the configuration states: pressures, and a loop's current.

    A bench of forces has no valve: a set point in its recordings is that of something else.
    """
    return [_stated(e, bench) for e in experiments]


def _stated(e: Experiment, bench: BenchSettings) -> Experiment:
    if bench.kind == "closed loop" and in_loop(e):
        return commanded(e, bench.proportional_gain)
    if bench.kind in NO_VALVE and len(e.current):
        e = _noted(replace(e, current=np.zeros(0)), "valve_current: not used, as there is no valve")
    for name, pressure in bench.chambers.items():
        if name in e.readings:
            e = _noted(e, f"{name}: not used, as the configuration states it")
        level = np.full(e.samples, 0.0 if math.isnan(pressure) else pressure)
        e = replace(e, readings=e.readings | {name: level})
    return e


def _noted(e: Experiment, note: str) -> Experiment:
    return replace(e, notes=(*e.notes, note))
