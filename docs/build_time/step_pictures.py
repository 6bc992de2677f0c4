"""What an effect does to a step of the reference machine: at its typical size, and off.

One model with the whole catalogue is compiled for all of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

import hil_emulator as hil
from hil_emulator.model.declare import Effect
from hil_emulator.model.effects import CATALOGUE
from hil_emulator.model.plant import Plant
from hil_emulator.model.sampling import Sensors
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.pages.palette import BLUE, VERMILION
from hil_emulator.platform.paths import cache_folder
from hil_emulator.simulation.assembly import compiled

KNEE = hil.load("hyq_knee").config

LASTS, ON, OFF, CURRENT = 0.3, 0.02, 0.18, 1.5e-3
"""Duration, beginning and end of the step [s], and its height [A]."""

SPOOL, SPEED = "spool_position", "velocity"

SEEN = ("position", "load_force", "pressure_a", "pressure_b", "supply_pressure", SPOOL, SPEED)
SHOWN = {"Pa": (1e-5, "bar"), "m": (1e3, "mm"), "A": (1e3, "mA"), "m/s": (1.0, "m/s"),
         "N": (1.0, "N")}  # fmt: skip

FURTHER: Mapping[str, Mapping[str, float]] = {
    "oil_heating": {"viscosity_temperature_slope": 3.68},
    "viscosity_temperature": {"oil_temperature": 333.15},
    "modulus_temperature": {"oil_temperature": 333.15},
    "accumulator": {"variable_pump_flow": 5e-5},
    "pump_leakage": {"fixed_pump_flow": 10e-3 / 60},
    "pump_friction": {"fixed_pump_flow": 10e-3 / 60},
    "wall": {"initial_position": 0.04},
}
"""Further parameters of effects that do not act on the reference machine alone."""

VISIBLE = 1e-4
"""Deviation over a signal's range from which a picture shows it (assumed)."""


@dataclass(frozen=True)
class Response:
    """The signal that an effect changes most, without and with it, over the time [s]."""

    signal: str
    time: np.ndarray
    without: np.ndarray
    within: np.ndarray
    visible: bool


def response(effect: Effect) -> Response:
    """Return what an effect does to a step of the valve current."""
    knob = effect.field_of(effect.knob)
    strength = {
        effect.field_of(p): p.typical if p is effect.knob or p.default is None else p.default
        for p in effect.params
    }
    runs = [_run(effect, {**strength, knob: value}) for value in (effect.off, effect.knob.typical)]
    without, within = runs
    # a range of less than a hundredth of the span is noise, and no step
    least = np.array([0.01 * next(c.span for c in CHANNELS if c.name == n) for n in SEEN])
    parts = np.ptp(without, axis=0) + least
    change = np.nan_to_num(np.abs(within - without).max(axis=0) / parts)
    chosen = int(np.argmax(change))
    time = 1e-9 * KNEE.tick_ns * np.arange(len(without))
    return Response(
        SEEN[chosen], time, without[:, chosen], within[:, chosen], bool(change[chosen] > VISIBLE)
    )


def _run(effect: Effect, strength: Mapping[str, float]) -> np.ndarray:
    """Return the sensors' readings during a run, shape (ticks, signals)."""
    of_sensor = effect.stage.table == "sensors"
    kernel = compiled(CATALOGUE, cache_folder())
    strengths = {} if of_sensor else strength
    plant = Plant(kernel, {**KNEE.plant, **FURTHER.get(effect.name, {}), **strengths}, KNEE.step)
    spans = {c.name: c.span for c in CHANNELS}
    scaled = {p.name for p in effect.params if p.unit.startswith("span")}
    settings = {
        name: {
            f: v * (spans[name] if f.removeprefix(f"{effect.name}_") in scaled else 1.0)
            for f, v in strength.items()
        }
        for name in SEEN
    }
    tick = KNEE.tick_ns * 1e-9
    sensors = Sensors(kernel, settings if of_sensor else {}, tick, np.random.default_rng(1))
    columns = [sensors.names.index(name) for name in SEEN]
    rows = []
    for i in range(round(LASTS / tick)):
        plant.inputs.valve_current = CURRENT if ON <= i * tick < OFF else 0.0
        plant.step(KNEE.steps)
        sensors.sample(plant.signal_vector, plant.path)
        rows.append(sensors.reading[columns].copy())
    return np.array(rows)


def drawn(step: Response) -> Figure:
    """Draw it."""
    unit = next(c.unit for c in CHANNELS if c.name == step.signal)
    factor, shown = SHOWN[unit]
    figure = Figure(figsize=(6.4, 2.2), layout="constrained")
    axes = figure.subplots()
    axes.plot(step.time, factor * step.without, "--", color=VERMILION, lw=1.2, label="off")
    axes.plot(step.time, factor * step.within, color=BLUE, lw=1.2, label="typical")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{step.signal.replace('_', ' ')} [{shown}]")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    return figure
