"""The actuator and its sensors as objects with memory: what the loop steps and reads."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hil_emulator.model import actuator
from hil_emulator.model.declare import Effect
from hil_emulator.model.kernel import Kernel, Vector, named, zeros
from hil_emulator.model.sensors import CHANNELS

_BLOCK = 256  # normal numbers are drawn for that many samples at once


def fill(layout: np.dtype[Any], effects: Iterable[Effect], values: Mapping[str, float]) -> Vector:
    """Return a parameter vector: `values` by field, each effect off where nothing is said.

    Raises:
        KeyError: if a value names no field, or a field has neither value nor default.

    """
    known = {f"{table}_{p.name}": p.default for table, ps in actuator.PARAMS.items() for p in ps}
    for effect in effects:
        known[effect.field_of(effect.knob)] = effect.off
        known |= {effect.field_of(p): p.default for p in effect.shape}
    fields = layout.names or ()
    for name in values:
        if name not in fields:
            raise KeyError(f"no parameter '{name}'")
    chosen = [values.get(name, known[name]) for name in fields]
    missing = [name for name, value in zip(fields, chosen, strict=True) if value is None]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    return np.array(chosen, dtype=np.float64)


class Plant:
    """One actuator: parameters, state, inputs and signals, each a record over flat memory.

    Starts at rest at the configured position, in the equilibrium of an unloaded valve:
    p_a = alpha p_s / (1 + alpha), p_b = p_s / (1 + alpha) (S1, operating point).

    Args:
        kernel: the compiled model.
        values: parameters by field name, SI; effects that are not named are off.
        step: width of an integration step [s].

    """

    def __init__(self, kernel: Kernel, values: Mapping[str, float], step: float) -> None:
        self.kernel = kernel
        self.step_width = step
        self.parameter_vector = fill(kernel.parameters, kernel.effects, values)
        self.input_vector = zeros(kernel.inputs)
        self.signal_vector = zeros(kernel.signals)
        self._input_index = {name: i for i, name in enumerate(kernel.inputs.names or ())}
        self._memory = zeros(kernel.state, count=6)
        self.state_vector = self._memory[: len(kernel.state.names or ())]
        self.parameters = named(self.parameter_vector, kernel.parameters)
        self.inputs = named(self.input_vector, kernel.inputs)
        self.signals = named(self.signal_vector, kernel.signals)
        self.state = named(self.state_vector, kernel.state)
        self._start()

    def _start(self) -> None:
        par, state = self.parameters, self.state
        alpha = par.cylinder_area_ratio
        state.position = par.initial_position
        state.pressure_a = alpha * par.supply_pressure / (1.0 + alpha)
        state.pressure_b = par.supply_pressure / (1.0 + alpha)
        self.step(0)

    def command(self, commands: Mapping[str, float]) -> None:
        """Set inputs by name; they hold until the next command."""
        for name, value in commands.items():
            self.input_vector[self._input_index[name]] = value

    def step(self, steps: int) -> None:
        """Integrate `steps` steps with the inputs held, and evaluate the signals there."""
        self.kernel.run(
            self._memory, self.parameter_vector, self.input_vector, self.signal_vector,
            self.step_width, steps,
        )  # fmt: skip


class Sensors:
    """The channels of one actuator.

    Args:
        kernel: the compiled model.
        parameters: transducer parameters by channel and field; what is missing is off.
        period: time between samples [s].
        random: source of the noise.

    """

    def __init__(
        self,
        kernel: Kernel,
        parameters: Mapping[str, Mapping[str, float]],
        period: float,
        random: np.random.Generator,
    ) -> None:
        self.names = tuple(c.name for c in CHANNELS)
        self._read = kernel.read
        self._period = period
        self._random = random
        signals = list(kernel.signals.names or ())
        self._sources = np.array([signals.index(c.signal) for c in CHANNELS])
        self.parameters = np.concatenate(
            [fill(kernel.channel, kernel.effects, parameters.get(n, {})) for n in self.names]
        )
        self._memory = np.full(len(CHANNELS) * len(kernel.memory.names or ()), math.nan)
        self.reading = np.zeros(len(CHANNELS))
        self.overrange = np.zeros(len(CHANNELS), np.int64)
        self._normals = np.empty((_BLOCK, len(CHANNELS)))
        self._next = _BLOCK

    def sample(self, signals: Vector) -> None:
        """Fill `reading` and `overrange` from the model's signals, shape (signals,)."""
        if self._next == _BLOCK:
            self._random.standard_normal(out=self._normals)
            self._next = 0
        self._read(
            signals, self._sources, self.parameters, self._memory, self._normals[self._next],
            self._period, self.reading, self.overrange,
        )  # fmt: skip
        self._next += 1
