"""The configured actuator as identification sees it: its memory and what may change in it."""

import inspect
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from hil_emulator.config.load import Configuration
from hil_emulator.identify.measured.experiment import SPANS, Array, Index
from hil_emulator.identify.prediction.machine_code import bind
from hil_emulator.identify.prediction.probes import DRIFT, PROBES
from hil_emulator.identify.prediction.records import ParametrisedModel, Tick
from hil_emulator.identify.prediction.remembered import Remembered, followed, recorded
from hil_emulator.identify.prediction.run import INPUT_COUNT
from hil_emulator.model import kernel, quantities
from hil_emulator.model.declare import Effect, Param, is_on
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import fill, length
from hil_emulator.model.plant import Plant
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.model.stages import (
    CONTINUOUS,
    SAMPLED,
    coupling_acts,
    dry_friction_acts,
    holding_acts,
    source_acts,
)

USUAL_SPEED = 0.1
"""A usual speed of the rod [m/s] (assumed)."""

SHAPE_PRIOR = 0.5
"""Relative standard deviation of what a law holds beside its knob (assumed)."""

_TINY = {"pressure_a": 1.0, "pressure_b": 1.0, "pump_pressure": 1.0}


@dataclass(frozen=True)
class Coordinate:
    """One number of the model that a fit may change, on an engineering scale.

    Attributes:
        name: what people call it, `effect` or `channel.effect` or `table_param`.
        field: its field in the parameter record.
        channel: the sensor channel, or "" for the plant.
        unit: SI unit.
        shown: the unit for people.
        scale: one engineering unit of it, in `unit` (of the inverse where `inverse`).
        neutral: the value in the configuration; `inverse` measures 1/value from zero.
        inverse: whether it is off at infinity, so that 1/value is what grows from zero.
        low: smallest value.
        high: largest value.
        prior: standard deviation of an ordinary parameter, in `scale`; infinite for an effect.
        effect: the declaration, or None for a parameter that every actuator has.

    """

    name: str
    field: str
    channel: str
    unit: str
    shown: str
    scale: float
    neutral: float
    inverse: bool
    low: float
    high: float
    prior: float
    effect: Effect | None

    def value(self, coordinate: float) -> float:
        """Return the parameter [unit] at a coordinate; 0 is the configuration."""
        if self.inverse:
            return 1.0 / (coordinate * self.scale) if coordinate > 0.0 else math.inf
        return self.neutral + coordinate * self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest coordinate."""
        if self.inverse:
            return 0.0, 1.0 / (max(self.low, 1e-300) * self.scale)
        return (self.low - self.neutral) / self.scale, (self.high - self.neutral) / self.scale

    @property
    def place(self) -> str:
        """The sensor, or the part of the machine, at which an effect acts; "" of none."""
        return self.channel or (self.effect.stage.table if self.effect else "")

    @property
    def stage(self) -> str:
        """The sensor, or the stage of the model, at which an effect acts; "" of none."""
        return self.channel or (self.effect.stage.name if self.effect else "")

    def belongs_to(self, effect: str) -> bool:
        """Tell whether it is the knob or a shape parameter of an effect."""
        return self.name == effect or self.name.startswith(f"{effect}.")


SHARED_STATES = (
    (dry_friction_acts, quantities.FRICTION_STATES),
    (source_acts, quantities.SUPPLY_STATES),
    (holding_acts, quantities.HOLDING_STATES),
    (coupling_acts, quantities.COUPLING_STATES),
)
"""States that move only where an effect of a stage is on."""

DIVISION = {"PIECES": 4, "VELOCITY_DOUBT": 3e-5}
"""How a step is divided in which something hits. A prediction reaches one sample ahead and readings
correct it: of a rod that is driven against the ends of its stroke, chi-square changes by less than
one in a thousand at the largest step, and a stiff coupling takes half as long.
"""


@lru_cache(maxsize=4)
def probed(effects: tuple[Effect, ...], folder: Path | None) -> Kernel:
    """Return the kernel with probes: one per catalogue, as what calls it is compiled for it."""
    return kernel.build((*effects, *PROBES, DRIFT), cache=folder, constants=DIVISION)


def _has(config: Configuration, part: Effect) -> bool:
    """Tell whether a machine has a part: what it has not, no step should have to carry."""
    return is_on(part, config.plant.get(part.field_of(part.knob), part.off))


class PlantModel:
    """Parameter memory of one configuration, with every effect's shape at its default.

    Args:
        config: the configuration that should describe the machine.
        cache: folder for compiled models.

    """

    def __init__(self, config: Configuration, cache: Path | None) -> None:
        self.config = config
        self.effects = tuple(e for e in config.effects if e.named or _has(config, e))
        self.kernel = probed(self.effects, cache)
        self.loops = bind(self.kernel, cache)
        # ends that nobody has stated tell nothing of a log, whose position may count from anywhere
        gone = {e.field_of(p) for e in config.effects if e not in self.effects for p in e.params}
        said = {n: v for n, v in config.plant.items() if n not in config.unsaid | gone}
        self.plant_values = self._with_shapes(said)
        self.par = fill(self.kernel.parameters, self.kernel.effects, self.plant_values)
        self.names = tuple(c.name for c in CHANNELS)
        rows = [self._channel(name, config.sensors.get(name, {})) for name in self.names]
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
        moving = [e for e in self.kernel.effects if e.stage in CONTINUOUS]
        self._movers = [self._mover(e) for e in moving]
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
        # a shape whose default is zero, as a spring's rest at the stop, is taken where it is usual
        shapes = {e.field_of(p): (p.default or p.typical) * (longer if p.along_stroke else 1.0)
                  for e in self.effects if e.stage not in SAMPLED for p in e.shape}  # fmt: skip
        return shapes | values

    def _channel(self, name: str, values: dict[str, float]) -> Array:
        """Return a channel's deterministic part: a predictor knows neither noise nor steps."""
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
        """Return the plant's and the sensors' parameters with coordinates moved."""
        par, chan = self.par.copy(), self.chan.copy()
        for coordinate, value in zip(coordinates, at, strict=True):
            sensor, i = self.index(coordinate)
            (chan if sensor else par)[i] = coordinate.value(float(value))
        return par, chan

    def at(
        self, par: Array, chan: Array, step: float = 0.0, steps: int = 0, tick: Tick | None = None
    ) -> ParametrisedModel:
        """Return the model at given parameters for the loops, which make `steps` per sample [s]."""
        return ParametrisedModel(
            tick or self.loops.ticks.whole, self.loops.rate, self.loops.sense, par, chan,
            self.drift, self.supply, self.bend, self.velocity, self.chambers, self.sources,
            self.remembered, self._places(self._followed, chan), self._places(self._recorded, chan),
            len(self.signal_names), step, steps,
        )  # fmt: skip

    def _places(self, remembered: Sequence[Remembered], chan: Array) -> Index:
        """Return where acting effects remember, and the index of the signal that each follows."""
        acting = [r for r in remembered if is_on(r.effect, chan[r.knob])]
        places = [(at, self.sources[r.channel]) for r in acting for at in r.places]
        return np.array(places, np.int64).reshape(-1, 2)

    def start(self, par: Array, step: float, pressures: tuple[float, float] | None) -> Array:
        """Return the state at rest of a parameter set, at the given chamber pressures [Pa]."""
        names = list(self.kernel.parameters.names or ())
        plant = Plant(self.kernel, dict(zip(names, par.tolist(), strict=True)), step)
        if pressures:
            plant.set_pressures(max(pressures[0], 1e4), max(pressures[1], 1e4))
        return plant.state_vector.copy()

    def active(self, par: Array) -> list[str]:
        """Return the states that move: those of every actuator and of the effects that act."""
        acting = [m for m in self._movers if is_on(m[0], float(par[m[1]]))]
        at = {law.stage.name for effect, _, _ in acting for law in effect.laws}
        states = [q.name for q in quantities.STATES]
        for acts, moved in SHARED_STATES:
            if acts.stage.name in at:
                states += [q.name for q in moved]
        return states + [name for _, _, own in acting for name in own]

    def fastest(self, par: Array) -> float:
        """Return the largest eigenvalue of the model around rest and slow motion [rad/s]."""
        state = self.start(par, 1e-5, None)
        names = list(self.kernel.state.names or ())
        rows = [names.index(n) for n in self.active(par)]
        return max(self._spectral_radius(par, state, rows, v) for v in (0.0, USUAL_SPEED))

    def _spectral_radius(self, par: Array, state: Array, rows: list[int], velocity: float) -> float:
        state = state.copy()
        state[list(self.kernel.state.names or ()).index("velocity")] = velocity
        inputs, signals = np.zeros(INPUT_COUNT), np.zeros(len(self.signal_names))
        base, moved = np.zeros(len(state)), np.zeros(len(state))
        self.kernel.rate(state, base, par, inputs, signals)
        jacobian = np.zeros((len(rows), len(rows)))
        for j, row in enumerate(rows):
            other = state.copy()
            other[row] += _TINY.get(list(self.kernel.state.names or ())[row], 1e-7)
            self.kernel.rate(other, moved, par, inputs, signals)
            jacobian[:, j] = (moved - base)[rows] / (other[row] - state[row])
        if not np.isfinite(jacobian).all():
            return float("inf")
        return float(np.max(np.abs(np.linalg.eigvals(jacobian))))

    def _mover(self, effect: Effect) -> tuple[Effect, int, list[str]]:
        """Return an effect, its knob's index and its states."""
        own = [effect.field_of(q) for q in effect.states]
        return effect, self._par_at[effect.field_of(effect.knob)], own

    def knob(self, effect: Effect, channel: str, prior: float) -> Coordinate:
        """Return the knob of an effect as a coordinate."""
        knob: Param = effect.knob
        span = SPANS[channel] if channel and knob.unit == "span" else 1.0
        field = effect.field_of(knob)
        table = self.chan if channel else self.par
        at = (self.names.index(channel) * len(self._chan_at) + self._chan_at[field]
              if channel else self._par_at[field])  # fmt: skip
        inverse = math.isinf(effect.off)
        unit = next(c.unit for c in CHANNELS if c.name == channel) if span != 1.0 else knob.unit
        return Coordinate(
            name=f"{channel}.{effect.name}" if channel else effect.name,
            field=field, channel=channel, unit=unit,
            shown="" if span != 1.0 else knob.shown,
            scale=1.0 / (knob.typical * span) if inverse else abs(knob.typical - effect.off) * span,
            neutral=float(table[at]), inverse=inverse,
            low=knob.low * span, high=knob.high * span, prior=prior, effect=effect,
        )  # fmt: skip

    def shapes(self, knob: Coordinate) -> list[Coordinate]:
        """Return what else the law of an effect holds, to be fitted around what is usual."""
        effect = knob.effect
        if effect is None:
            return []
        span = SPANS[knob.channel] if knob.channel else 1.0
        table = self.chan if knob.channel else self.par
        found = []
        for p in effect.shape:
            field = effect.field_of(p)
            size = span if p.unit == "span" else 1.0
            shape = Coordinate(
                name=f"{knob.name}.{p.name}", field=field, channel=knob.channel,
                unit=knob.unit if p.unit == "span" else p.unit, shown=p.shown, scale=0.0,
                neutral=0.0, inverse=False, low=p.low * size, high=p.high * size, prior=1.0,
                effect=effect,
            )  # fmt: skip
            neutral = float(table[self.index(shape)[1]])
            if np.isfinite(neutral) and neutral != 0.0:
                scale = SHAPE_PRIOR * abs(neutral)
                found.append(replace(shape, scale=scale, neutral=neutral))
        return found


def predictable(effect: Effect) -> bool:
    """Whether a transducer effect changes what is expected, rather than scatter or round it."""
    arguments = inspect.signature(effect.law).parameters
    return "normal" not in arguments and effect.knob.name != "step"


def concerns(effect: Effect, channel: str) -> bool:
    """Whether a transducer effect can act in a channel: few channels look at another one."""
    wired = next(c for c in CHANNELS if c.name == channel).differenced
    return bool(wired) or "differenced" not in inspect.signature(effect.law).parameters
