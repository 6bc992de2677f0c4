"""The actuator and its sensors as objects with memory: what the loop steps and reads."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from hil_emulator.model.bound import bound
from hil_emulator.model.digits import NOT_FINITE, WORD_LENGTH
from hil_emulator.model.effects.history import HISTORY
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import Vector, fill, length, named, zeros
from hil_emulator.model.lent_memory import addresses
from hil_emulator.model.rest import STRETCHING, bearing_pressures, stretch_under, without_gas
from hil_emulator.model.sensors import CHANNELS

__all__ = ["Plant", "Sensors", "Supply", "fill", "longest_delay", "on_one_supply"]

Matrix = np.ndarray[Any, np.dtype[np.float64]]

Memory = np.ndarray[Any, Any]

NOT_FOLLOWED: Matrix = np.empty((0, len(CHANNELS)))
"""The path of quantities of which only the end is known."""

NOTHING: Vector = np.empty(0)

_HOLDINGS = 20
"""How often the joints of a leg are held in turn: each bears what the others leave (assumed)."""

_BLOCK = 256  # normal numbers are drawn for that many samples at once


class Supply:
    """The memory of all actuators on one supply, and what moves them: together, step by step.

    Args:
        kernel: the model, compiled for so many actuators.
        step: width of an integration step [s].

    Attributes:
        built_in: whether it is the model's balances that move them.
        failure: what has ended its motion for good; "" while nothing has.
        paths: what the channels of each actuator met in the last tick, see `Plant.path`.

    """

    built_in = True

    def __init__(self, kernel: Kernel, step: float) -> None:
        self.failure = ""
        count = kernel.actuators
        self.kernel = kernel
        self.step_width = step
        self.states = zeros(kernel.state, count)
        self.past = np.full(count * length(kernel.past), math.nan)
        self.parameters = zeros(kernel.parameters, count)
        self.inputs = zeros(kernel.inputs, count)
        self.signals = zeros(kernel.signals, count)
        self._path = np.empty((0, count * len(CHANNELS)))
        self.paths = [NOT_FOLLOWED] * count
        self._tick: Callable[..., int]
        self._steps = -1

    def step(self, steps: int) -> bool:
        """Integrate `steps` steps with the inputs held, and evaluate the signals there.

        One call is one tick: a delay of the set point counts calls.

        Returns:
            Whether every state is finite.

        """
        if steps != self._steps:
            self._prepare(steps)
        finite = self._tick(-1, 0, 0) != NOT_FINITE
        if len(self.paths) > 1:
            for own, met in zip(self.paths, self._parts, strict=True):
                own[:] = met
        return finite

    def step_and_report(
        self, steps: int, instruments: Sequence[Memory], period: float
    ) -> Callable[[int, int, int], int] | None:
        """Return what does as `step` for so many steps and then as `Kernel.report`, in one call.

        Args:
            steps: integration steps.
            instruments: the first arrays of `Kernel.report`.
            period: time between samples [s].

        Returns:
            Takes the last arguments of `Kernel.report`; returns `NOT_FINITE` without a report, if
            a state is not finite. None where one call cannot do both.

        """
        if not self.built_in or self.kernel.actuators > 1:
            return None
        if steps != self._steps:
            self._prepare(steps)
        return self._bind(steps, instruments, period)

    def _prepare(self, steps: int) -> None:
        """Make room for what the channels meet in so many steps."""
        if steps > len(self._path):
            self._path = np.empty((steps, self._path.shape[1]))
        self._steps = steps
        self._parts = np.split(self._path[:steps], self.kernel.actuators, axis=1)
        self.paths = [np.ascontiguousarray(part) for part in self._parts]
        self._tick = self._bind(steps, (), 0.0)

    def _bind(self, steps: int, instruments: Sequence[Memory], period: float) -> Callable[..., int]:
        """Return a call of `tick_and_report`, see `kernel.Kernel`."""
        memory = (
            self.states, self.past, self.parameters, self.inputs, self.signals, self._path,
        )  # fmt: skip
        return bound(
            self.kernel.tick_and_report, addresses(*memory), addresses(*instruments),
            self.step_width, steps, period, left=(0, 0, 0), lent=(*memory, *instruments),
        )  # fmt: skip

    def close(self) -> None:
        """End what runs beside this process: for the model's balances nothing does."""


class Plant:
    """One actuator: parameters, state, inputs and signals, each a record over flat memory.

    Starts at rest at the configured position, in equilibrium with its load and with an unloaded
    valve: p_a + p_b = p_s and A_p (p_a - alpha p_b) = F, without a load p_a = alpha p_s/(1 + alpha)
    and p_b = p_s/(1 + alpha) (S1, operating point).

    Args:
        kernel: the compiled model.
        values: parameters by field name, SI; effects that are not named are off.
        step: width of an integration step [s].
        supply: the supply that it shares, see `on_one_supply`; its own without one.
        place: its number there.

    Attributes:
        input_places: where each input is in `input_vector`, by name.

    """

    def __init__(
        self, kernel: Kernel, values: Mapping[str, float], step: float,
        supply: Supply | None = None, place: int = 0,
    ) -> None:  # fmt: skip
        self.kernel = kernel
        self.step_width = step
        self.supply = supply or Supply(kernel, step)
        self._place = place

        def own(memory: Vector, layout: np.dtype[Any]) -> Vector:
            return memory[place * length(layout) : (place + 1) * length(layout)]

        self.parameter_vector = own(self.supply.parameters, kernel.parameters)
        self.parameter_vector[:] = fill(kernel.parameters, kernel.effects, values)
        self.input_vector = own(self.supply.inputs, kernel.inputs)
        self.signal_vector = own(self.supply.signals, kernel.signals)
        self.input_places = {name: i for i, name in enumerate(kernel.inputs.names or ())}
        self._past = own(self.supply.past, kernel.past)
        self.state_vector = own(self.supply.states, kernel.state)
        self.parameters = named(self.parameter_vector, kernel.parameters)
        self.inputs = named(self.input_vector, kernel.inputs)
        self.signals = named(self.signal_vector, kernel.signals)
        self.state = named(self.state_vector, kernel.state)
        self._start()

    def restart(self) -> None:
        """Be at rest at the configured position again, with the parameters and inputs it has."""
        self.state_vector[:] = 0.0
        self._past[:] = math.nan
        self._start()

    def _start(self) -> None:
        par = self.parameters
        alpha = par.cylinder_area_ratio
        self.state.position = par.initial_position
        self.set_pressures(
            alpha * par.supply_pressure / (1.0 + alpha), par.supply_pressure / (1.0 + alpha)
        )
        self.hold_load()

    def hold_load(self) -> None:
        """Put pressures into the chambers that hold the load as it rests.

        A load that no pressures between tank and supply hold is left to fall.
        """
        par, force = self.parameters, float(self.signals.resisting_force)
        pressures = bearing_pressures(
            force, float(par.tank_pressure), float(par.supply_pressure),
            float(par.cylinder_area_ratio), float(par.cylinder_piston_area),
        )  # fmt: skip
        if math.isnan(pressures[0]):
            return
        elastic = [float(par[name]) if self.knows(name) else 0.0 for name in STRETCHING]
        self.state.stretch = stretch_under(force, *elastic)
        self.set_pressures(*pressures)

    def set_pressures(self, pressure_a: float, pressure_b: float) -> None:
        """Put pressures [Pa] into the chambers, and evaluate the signals there."""
        self.step(0)
        gas = float(self.signals.gas_pressure)
        self.state.pressure_a = without_gas(pressure_a, gas)
        self.state.pressure_b = without_gas(pressure_b, gas)
        self.step(0)

    def knows(self, parameter: str) -> bool:
        """Whether the compiled model has a parameter of this field name."""
        return parameter in (self.kernel.parameters.names or ())

    @property
    def has_ends(self) -> bool:
        """Whether end stops keep the rod within its stroke."""
        return self.knows("end_stops_stiffness") and self.parameters.end_stops_stiffness > 0.0

    @property
    def beyond_stroke(self) -> bool:
        """Whether the rod is outside its stroke."""
        return not 0.0 <= self.signals.position <= self.parameters.cylinder_stroke

    def culprit(self) -> str:
        """Return the name of the first state that is not finite, "" where all are."""
        names = zip(self.kernel.state.names or (), self.state_vector.tolist(), strict=True)
        return next((name for name, value in names if not math.isfinite(value)), "")

    def command(self, commands: Mapping[str, float]) -> None:
        """Set inputs by name; they hold until the next command."""
        for name, value in commands.items():
            self.input_vector[self.input_places[name]] = value

    def step(self, steps: int) -> bool:
        """Move it, and with it all that are on its supply: see `Supply.step`."""
        return self.supply.step(steps)

    @property
    def path(self) -> Matrix:
        """Each channel's quantity after every step of the last tick, shape (steps, channels).

        Where no effect is a sensing element only its last row is known.
        """
        return self.supply.paths[self._place]


def on_one_supply(
    kernel: Kernel, values: Sequence[Mapping[str, float]], step: float
) -> list[Plant]:
    """Return actuators that share pump, accumulator and lines; equal in the parameters of these.

    Args:
        kernel: the model, compiled for so many actuators.
        values: parameters of each by field name, SI; effects that are not named are off.
        step: width of an integration step [s].

    """
    supply = Supply(kernel, step)
    plants = [Plant(kernel, own, step, supply, place) for place, own in enumerate(values)]
    supply.step(0)
    for _ in range(_HOLDINGS):
        for plant in plants:
            plant.hold_load()
    return plants


class Sensors:
    """The channels of one actuator.

    Args:
        kernel: the compiled model.
        parameters: transducer parameters by channel and field; what is missing is off.
        period: time between samples [s].
        random: source of the noise.

    Attributes:
        reading: what each channel reports, SI.
        overrange: -1 at the lower end of a channel's measuring range, +1 at the upper one, else 0.
        ranges: the same as one number, 0 where no channel is at an end.
        count: number of the last sample, from 0.
        record: the last sample as bytes, see `lay_out`.

    """

    def __init__(
        self,
        kernel: Kernel,
        parameters: Mapping[str, Mapping[str, float]],
        period: float,
        random: np.random.Generator,
    ) -> None:
        self.names = tuple(c.name for c in CHANNELS)
        self._kernel = kernel
        self._period = period
        # a stream for each channel, so that one more leaves the others' noise as it is
        self._streams = random.spawn(len(CHANNELS))
        self.parameters = np.concatenate(
            [fill(kernel.channel, kernel.effects, parameters.get(n, {})) for n in self.names]
        )
        self._memory = np.full(len(CHANNELS) * length(kernel.memory), math.nan)
        self._past = np.full(len(CHANNELS) * length(kernel.channel_past), math.nan)
        self.reading = np.zeros(len(CHANNELS))
        self.overrange = np.zeros(len(CHANNELS), np.int64)
        self._normals = np.empty((_BLOCK, len(CHANNELS)))
        self._next = _BLOCK
        self.ranges: int = 0
        self.count = -1
        self._signals, self._path = NOTHING, NOT_FOLLOWED
        self._after: tuple[Sequence[Matrix], int, Callable[[int], int]] | None = None
        self.lay_out([], 0)

    def lay_out(self, words: Sequence[Sequence[float]], length: int) -> None:
        """Let a record show readings from the next sample on.

        Args:
            words: what stands where in it, see `digits.pack`.
            length: its bytes.

        """
        self.record = bytearray(length)
        self._words = np.array(words, np.float64).reshape(-1, WORD_LENGTH)
        self._bytes = np.frombuffer(self.record, np.uint8)
        self._after = None
        if len(self._signals):
            self._bind(self._signals, self._path)

    def restart(self) -> None:
        """Forget what was read so far."""
        self._memory[:] = math.nan
        self._past[:] = math.nan

    def sample(self, signals: Vector, path: Matrix = NOT_FOLLOWED, time_us: int = 0) -> None:
        """Fill `reading`, `overrange`, `ranges` and `record`.

        Args:
            signals: the model's signals, shape (signals,).
            path: what the elements met since the last sample, see `Plant.path`; where nothing
                followed that, their quantities went straight to their values of now.
            time_us: time of the sample [us], which the record may show.

        """
        if signals is not self._signals or path is not self._path:
            self._bind(signals, path)
        self.again(time_us)

    def again(self, time_us: int) -> int:
        """Sample the same signals and path as `sample` did last; return `ranges`."""
        row = self._next
        if row == _BLOCK:
            row = self._draw()
        self._next = row + 1
        self.count += 1
        self.ranges = self._sense(row, self.count, time_us)
        return self.ranges

    def after(self, supply: Supply, steps: int) -> Callable[[int], int]:
        """Return what lets a supply pass so many steps, and then does as `again`.

        It returns `NOT_FINITE` without a sample if a state is not finite. It is for one layout of
        the record, and until the supply is moved by another number of steps.
        """
        # whoever asks again in the same circumstances, after each heartbeat, gets the same
        if self._after is None or self._after[0] is not supply.paths or self._after[1] != steps:
            made = self._passing(supply, steps)
            self._after = supply.paths, steps, made
        return self._after[2]

    def _passing(self, supply: Supply, steps: int) -> Callable[[int], int]:
        """Return what `after` returns."""
        both = supply.step_and_report(steps, self._instruments, self._period)
        if both is None:
            return lambda time_us: self.again(time_us) if supply.step(steps) else NOT_FINITE

        def pass_and_sample(time_us: int) -> int:
            row = self._next
            if row == _BLOCK:
                row = self._next = self._draw()
            ranges = both(row, self.count + 1, time_us)
            if ranges != NOT_FINITE:
                self._next = row + 1
                self.count += 1
                self.ranges = ranges
            return ranges

        return pass_and_sample

    @property
    def _instruments(self) -> tuple[Memory, ...]:
        return (
            self.parameters, self._memory, self._past, self._normals, self.reading, self.overrange,
            self._words, self._bytes,
        )  # fmt: skip

    def _draw(self) -> int:
        """Draw the normal numbers of the next samples; return the row of the first."""
        for channel, stream in enumerate(self._streams):
            self._normals[:, channel] = stream.standard_normal(_BLOCK)
        return 0

    def _bind(self, signals: Vector, path: Matrix) -> None:
        self._signals, self._path = signals, path
        self._sense = bound(
            self._kernel.report, self.parameters, self._memory, self._past, self._normals,
            self._period, self.reading, self.overrange, self._words, self._bytes, signals, path,
            left=(0, 0, 0),
        )  # fmt: skip


def longest_delay(period: float) -> float:
    """Return the longest time that delays and windows can look back [s] at a tick `period`."""
    return (HISTORY - 1) * period
