"""Model of the configured actuator for identification: parameters, coordinates and states."""

import inspect
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from hil_emulator.config.load import Configuration
from hil_emulator.identify.measured.experiment import FLOWS, SPANS, UNITS, Array, Index
from hil_emulator.identify.prediction.model_run.records import ParametrisedModel, Tick
from hil_emulator.identify.prediction.plant.active_states import ActiveStates
from hil_emulator.identify.prediction.plant.coordinate import Coordinate, scaled
from hil_emulator.identify.prediction.plant.machine_code import bind
from hil_emulator.identify.prediction.plant.nominal import nominal
from hil_emulator.identify.prediction.plant.probes import DRIFT, PROBES
from hil_emulator.identify.prediction.plant.sensor_memory import SensorMemory, followed, recorded
from hil_emulator.model import kernel, quantities
from hil_emulator.model.declare import Effect, Param, factor, is_on
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import fill, length
from hil_emulator.model.plant import Plant, Supply
from hil_emulator.model.rating import REFERENCE_CURRENT, sized
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import SAMPLED

USUAL_SPREAD = factor(1.5)
"""Spread of a shape parameter of a user's effect without a declared spread (assumed)."""

SLOWER = 100.0
"""Time constant of a flow meter over that of another transducer (assumed: 10 ms to some seconds for
turbines and gear meters, 0.1 to 2 ms for pressure sensors)."""

DIVISION = {"PIECES": 4, "VELOCITY_DOUBT": 3e-5}
"""Subdivision of an integration step with an impact. It is coarser than in a simulation, since each
prediction covers one sample: for a rod driven against its end stops, chi-square changes by less
than 0.1 % at the largest step, and a stiff coupling takes half the time. """


@lru_cache(maxsize=4)
def probed(effects: tuple[Effect, ...], folder: Path | None) -> Kernel:
    """Return the kernel with probes, cached by the effects."""
    return kernel.build((*effects, *PROBES, DRIFT), cache=folder, constants=DIVISION)


def _has(config: Configuration, part: Effect) -> bool:
    """Return whether a machine has a part; absent parts are not compiled into the step."""
    return is_on(part, config.plant.get(part.field_of(part.knob), part.off))


class _Balances(Supply):
    """Supply that uses the kernel's integration, to find its equilibrium without further code."""

    def step(self, steps: int) -> bool:
        """Integrate over some steps."""
        path = np.empty((steps, len(CHANNELS)))
        return self.kernel.tick(
            self.states, self.past, self.parameters, self.inputs, self.signals, path,
            self.step_width, steps,
        )  # fmt: skip


class PlantModel:
    """Parameters of one configuration, with default shape parameters of every effect.

    Args:
        config: the configuration that should describe the machine.
        cache: folder for compiled models.

    """

    def __init__(self, config: Configuration, cache: Path | None) -> None:
        self.config = config
        self.rated = config.rated_current or REFERENCE_CURRENT
        self.effects = tuple(e for e in config.effects if e.named or _has(config, e))
        self.kernel = probed(self.effects, cache)
        self.loops = bind(self.kernel, cache)
        # unstated ends of the stroke: the position of a log may have any zero point
        gone = {e.field_of(p) for e in config.effects if e not in self.effects for p in e.params}
        stated = {n: v for n, v in config.plant.items() if n not in config.unsaid | gone}
        self.nominal = nominal(stated, self.rated)
        self.plant_values = self._with_shapes(stated)
        self.par = fill(self.kernel.parameters, self.kernel.effects, self.plant_values)
        self.names = tuple(c.name for c in CHANNELS)
        rows = [self.transducer(name, config.sensors.get(name, {})) for name in self.names]
        self.chan = np.concatenate(rows)
        count = len(CHANNELS)
        self.remembered = np.array(
            [
                length(self.kernel.past),
                count * length(self.kernel.memory),
                count * length(self.kernel.channel_past),
            ]
        )
        self._par_at = {n: i for i, n in enumerate(self.kernel.parameters.names or ())}
        self._chan_at = {n: i for i, n in enumerate(self.kernel.channel.names or ())}
        self._followed = followed(self.kernel)
        self._recorded = recorded(self.kernel)
        self._moving = ActiveStates(self.kernel)
        self.signal_names = tuple(self.kernel.signals.names or ())
        self.sources = np.array([self.signal_names.index(c.signal) for c in CHANNELS])
        self.supply = self._par_at["supply_pressure"]
        states = self.kernel.state.names or ()
        self.bend, self.velocity = states.index("seal_bend"), states.index("velocity")
        self.chambers = np.array([states.index(name) for name in ("pressure_a", "pressure_b")])
        self.drift = self._par_at[DRIFT.field_of(DRIFT.knob)]
        self.probes = np.array([self._par_at[p.field_of(p.knob)] for p in PROBES])
        self.probe_sizes = np.array([p.knob.typical for p in PROBES])

    def _with_shapes(self, values: dict[str, float]) -> dict[str, float]:
        stroke = next(p for p in quantities.PARAMS["cylinder"] if p.name == "stroke")
        longer = values.get("cylinder_stroke", stroke.typical) / stroke.typical
        # a shape parameter with default zero gets its typical value
        shapes = {e.field_of(p): (p.default or p.typical) * (longer if p.along_stroke else 1.0)
                  for e in self.effects if e.stage not in SAMPLED
                  for p in (self.sized(shape, e.stage.table) for shape in e.shape)}  # fmt: skip
        return shapes | values

    def transducer(self, name: str, values: dict[str, float]) -> Array:
        """Return the parameters of a channel without noise and quantisation."""
        chosen: dict[str, float] = {}
        for effect in self.effects:
            if effect.stage not in SAMPLED:
                continue
            for p in effect.shape:
                scale = SPANS[name] if p.unit == "span" else 1.0
                chosen[effect.field_of(p)] = p.typical * scale if p.default is None else p.default
            if predictable(effect):
                chosen |= {effect.field_of(p): values[effect.field_of(p)]
                           for p in effect.params if effect.field_of(p) in values}  # fmt: skip
        return fill(self.kernel.channel, self.kernel.effects, chosen)

    def index(self, coordinate: Coordinate) -> tuple[bool, int]:
        """Return whether a coordinate belongs to the sensors, and its index in that memory."""
        if not coordinate.channel:
            return False, self._par_at[coordinate.field]
        row = self.names.index(coordinate.channel)
        return True, row * len(self._chan_at) + self._chan_at[coordinate.field]

    def memory(
        self, coordinates: Sequence[Coordinate], at: Sequence[float] | Array
    ) -> tuple[Array, Array]:
        """Return the parameters of plant and sensors at given coordinates."""
        par, chan = self.par.copy(), self.chan.copy()
        for coordinate, value in zip(coordinates, at, strict=True):
            sensor, i = self.index(coordinate)
            (chan if sensor else par)[i] = coordinate.value(float(value))
        return par, chan

    def at(
        self, par: Array, chan: Array, step: float = 0.0, steps: int = 0, tick: Tick | None = None
    ) -> ParametrisedModel:
        """Return the model at given parameters, for the compiled loops.

        Args:
            par: parameters of the plant.
            chan: parameters of the transducers.
            step: integration step [s].
            steps: integration steps per part of a sample period.
            tick: integration; None for that with all effects.

        """
        return ParametrisedModel(
            tick or self.loops.ticks.whole, self.loops.rate, self.loops.sense, par, chan,
            self.drift, self.supply, self.bend, self.velocity, self.chambers, self.sources,
            self.remembered, self._places(self._followed, chan), self._places(self._recorded, chan),
            len(self.signal_names), step, steps,
        )  # fmt: skip

    def _places(self, remembered: Sequence[SensorMemory], chan: Array) -> Index:
        """Return memory index and signal index of each memory of acting effects."""
        acting = [r for r in remembered if is_on(r.effect, chan[r.knob])]
        places = [(at, self.sources[r.channel]) for r in acting for at in r.places]
        return np.array(places, np.int64).reshape(-1, 2)

    def start(self, par: Array, step: float, pressures: tuple[float, float] | None) -> Array:
        """Return the equilibrium state of a parameter set, at given chamber pressures [Pa]."""
        names = list(self.kernel.parameters.names or ())
        values = dict(zip(names, par.tolist(), strict=True))
        plant = Plant(self.kernel, values, step, _Balances(self.kernel, step))
        if pressures:
            plant.set_pressures(max(pressures[0], 1e4), max(pressures[1], 1e4))
        return plant.state_vector.copy()

    def active(self, par: Array) -> list[str]:
        """Return the active states: those of every actuator and of the acting effects."""
        return self._moving.active(par)

    def fastest(self, par: Array) -> float:
        """Return the largest eigenvalue of the model at rest and in slow motion [rad/s]."""
        return self._moving.fastest(par, self.start(par, 1e-5, None))

    def sized(self, param: Param, table: str) -> Param:
        """Return a declaration with currents scaled to the valve's rating."""
        return sized(param, table, self.rated)

    def knob(self, effect: Effect, channel: str, prior: float) -> Coordinate:
        """Return the knob of an effect as a coordinate."""
        table = effect.stage.table
        knob = self.nominal.sized(self.sized(effect.knob, table), effect.stage)
        knob = of_a_meter(knob) if channel in FLOWS else knob
        span = self._span(channel) if channel and knob.unit == "span" else 1.0
        field = effect.field_of(knob)
        memory = self.chan if channel else self.par
        at = (self.names.index(channel) * len(self._chan_at) + self._chan_at[field]
              if channel else self._par_at[field])  # fmt: skip
        inverse = math.isinf(effect.off)
        unit = UNITS[channel] if span != 1.0 else knob.unit
        return Coordinate(
            name=f"{channel}.{effect.name}" if channel else effect.name,
            field=field, channel=channel, unit=unit,
            shown="" if span != 1.0 else knob.shown,
            scale=1.0 / (knob.typical * span) if inverse else abs(knob.typical - effect.off) * span,
            neutral=float(memory[at]), scaling="inverse" if inverse else "linear",
            low=knob.low * span, high=knob.high * span, prior=prior, effect=effect,
        )  # fmt: skip

    def _span(self, channel: str) -> float:
        """Return the typical range of a channel of this machine."""
        return SPANS[channel] * self.nominal.span(channel)

    def shapes(self, knob: Coordinate) -> list[Coordinate]:
        """Return the shape parameters of an effect, with priors around their typical values."""
        effect = knob.effect
        if effect is None:
            return []
        span = self._span(knob.channel) if knob.channel else 1.0
        table = self.chan if knob.channel else self.par
        shapes = []
        for p in (self.sized(shape, effect.stage.table) for shape in effect.shape):
            field, spread = effect.field_of(p), p.spread or USUAL_SPREAD
            size = span if p.unit == "span" else 1.0
            shape = Coordinate(
                name=f"{knob.name}.{p.name}", field=field, channel=knob.channel,
                unit=knob.unit if p.unit == "span" else p.unit, shown=p.shown, scale=0.0,
                neutral=0.0, scaling="linear", low=p.low * size, high=p.high * size, prior=1.0,
                effect=effect, power=p.power, stated=field in self.config.stated,
            )  # fmt: skip
            neutral = float(table[self.index(shape)[1]])
            if np.isfinite(neutral) and neutral != 0.0 and spread.size:
                scaling, scale = scaled(p, spread, neutral)
                shapes.append(replace(shape, scaling=scaling, scale=scale, neutral=neutral))
        return shapes


def of_a_meter(knob: Param) -> Param:
    """Return the declaration of a transducer's knob for a flow meter, with its slower dynamics."""
    times = {"s": SLOWER, "Hz": 1.0 / SLOWER}.get(knob.unit, 1.0)
    return replace(knob, typical=min(max(times * knob.typical, knob.low), knob.high))


def predictable(effect: Effect) -> bool:
    """Return whether a transducer effect is deterministic, not noise or quantisation."""
    arguments = inspect.signature(effect.law).parameters
    return "normal" not in arguments and effect.knob.name != "step"


def concerns(effect: Effect, channel: str) -> bool:
    """Return whether a transducer effect can act in a channel.

    Some effects need a differentiated or neighbouring channel.
    """
    wired = {c.name: c for c in CHANNELS}.get(channel)
    takes = inspect.signature(effect.law).parameters
    if wired is None:
        return not {"differenced", "neighbour"} & set(takes)
    return bool(wired.differenced) or "differenced" not in takes
