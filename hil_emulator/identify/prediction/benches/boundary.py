"""Boundary conditions of a bench, in place of the parts of an actuator that it does not have.

A test machine imposes the motion of the rod; an absent chamber has zero area; a stated constant
pressure replaces a channel. Other values that the configuration does not state are NaN, and so is
every result that depends on them.
"""

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hil_emulator.config.bench import BenchSettings
from hil_emulator.identify.measured.experiment import Experiment
from hil_emulator.identify.prediction.benches.position_loop import (
    commanded,
    estimated_gain,
    in_loop,
)
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.layout import fill
from hil_emulator.units import show

LOCKED = 1e12
"""Mass of a locked load [kg]: it moves by 1 um per hour under 100 kN."""

IMPOSED_MOTION = {"load_mass": LOCKED}
"""For a force balance, whose rod is moved by a drive."""

NO_CYLINDER = {"cylinder_piston_area": 0.0, "cylinder_area_ratio": 1.0}

ENDLESS_VOLUME = 1e3
"""Volume of a chamber whose pressure the flow does not change [m^3]."""

OPEN_PORTS = {
    "load_mass": LOCKED, **NO_CYLINDER, "cylinder_stroke": 1e-3, "initial_position": 0.0,
    "cylinder_dead_volume_a": ENDLESS_VOLUME, "cylinder_dead_volume_b": ENDLESS_VOLUME,
    "oil_bulk_modulus": 1e9,
}  # fmt: skip
"""For a valve with given port pressures; the bulk modulus has no influence."""

NO_VOLUME = 1e-12
"""Volume of a chamber whose pressure is in equilibrium at any time [m^3]: with edges open by 0.1
uA, which pass 1e-19 m^3/s per pascal, within 10 ms."""

AT_REST = {
    **OPEN_PORTS, "cylinder_dead_volume_a": NO_VOLUME, "cylinder_dead_volume_b": NO_VOLUME,
    "entrained_air_fraction": 0.0, "valve_natural_frequency": 1e5,
    "driver_lag_time_constant": 0.0, "pilot_lag_time_constant": 0.0,
    "spool_rate_limit_rate": math.inf,
}  # fmt: skip
"""For a valve in a slow sweep: in equilibrium, volumes, stiffness and speed have no influence. The
lag of a spool with 100 kHz is not measurable."""

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
    """Return the model with the boundary conditions of a bench."""
    values = dict(_BOUNDARIES.get(bench.kind, {}))
    if math.isnan(bench.chambers.get("pressure_b", 0.0)):
        values["cylinder_area_ratio"] = 0.0
    return with_values(model, values) if values else model


def with_gain(
    bench: BenchSettings, experiments: Sequence[Experiment], plant: Mapping[str, float]
) -> tuple[BenchSettings, list[str]]:
    """Return the bench with an estimate of an unstated loop gain, and a note."""
    looped = [e for e in experiments if in_loop(e)]
    if bench.kind != "closed loop" or not math.isnan(bench.proportional_gain) or not looped:
        return bench, []
    gain = estimated_gain(looped, plant)
    note = f"proportional gain: {show(gain, 'A/m')} fits the configured valve"
    return replace(bench, proportional_gain=gain), [note]


def as_stated(experiments: Sequence[Experiment], bench: BenchSettings) -> list[Experiment]:
    """Return experiments with stated pressures and the current of a stated position loop.

    The current in recordings of a bench without a valve is not used.
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
