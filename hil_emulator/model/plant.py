"""The actuator as an object with memory, stepped by the loop."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from hil_emulator.model.array_memory import addresses
from hil_emulator.model.bound import bound
from hil_emulator.model.digits import NOT_FINITE
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import Vector, fill, length, named, zeros
from hil_emulator.model.rest import STRETCHING, bearing_pressures, stretch_under, without_gas
from hil_emulator.model.sensors import CHANNELS

__all__ = ["Plant", "Supply", "fill", "on_one_supply"]

Matrix = np.ndarray[Any, np.dtype[np.float64]]

Memory = np.ndarray[Any, Any]

NOT_FOLLOWED: Matrix = np.empty((0, len(CHANNELS)))
"""Row of the path if only the end of a tick is stored."""

_HOLDINGS = 20
"""Iterations over the joints of a leg to find its rest (assumed)."""


class Supply:
    """The memory of all actuators on one supply, which are integrated together.

    Args:
        kernel: the model, compiled for this number of actuators.
        step: width of an integration step [s].

    Attributes:
        built_in: whether the built-in model integrates the actuators.
        failure: reason of a permanent failure; "" without one.
        paths: quantities of each actuator's channels in the last tick, see `Plant.path`.

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
            for path, met in zip(self.paths, self._parts, strict=True):
                path[:] = met
        return finite

    def step_and_report(
        self, steps: int, instruments: Sequence[Memory], period: float
    ) -> Callable[[int, int, int], int] | None:
        """Return a function that does `step` and then `Kernel.report`, in one call.

        Args:
            steps: integration steps.
            instruments: the first arrays of `Kernel.report`.
            period: time between samples [s].

        Returns:
            A function of the last arguments of `Kernel.report`, which returns `NOT_FINITE` without
            a report if a state is not finite. None if one call cannot do both.

        """
        if not self.built_in or self.kernel.actuators > 1:
            return None
        if steps != self._steps:
            self._prepare(steps)
        return self._bind(steps, instruments, period)

    def _prepare(self, steps: int) -> None:
        """Allocate the paths of the channels for `steps` steps."""
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
            self.step_width, steps, period, left=(0, 0, 0), kept_alive=(*memory, *instruments),
        )  # fmt: skip

    def close(self) -> None:
        """End a separate process of the plant; no action for the built-in model."""


class Plant:
    """One actuator: parameters, state, inputs and signals, each a record over flat memory.

    Starts at rest at the configured position, in equilibrium with its load and with an unloaded
    valve: p_a + p_b = p_s and A_p (p_a - alpha p_b) = F, without a load p_a = alpha p_s/(1 + alpha)
    and p_b = p_s/(1 + alpha) (S1, operating point).

    Args:
        kernel: the compiled model.
        values: parameters by field name, SI; effects that are not named are off.
        step: width of an integration step [s].
        supply: the shared supply, see `on_one_supply`; None for a separate supply.
        place: its number on the supply.

    Attributes:
        input_places: position of each input in `input_vector`, by name.

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
        """Return to rest at the configured position, with the present parameters and inputs."""
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
        """Set the chamber pressures that hold the load at rest.

        A load that cannot be held by pressures between tank and supply will fall.
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
        """Set the chamber pressures [Pa], and evaluate the signals there."""
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
        """Return the name of the first state that is not finite, "" if all are finite."""
        names = zip(self.kernel.state.names or (), self.state_vector.tolist(), strict=True)
        return next((name for name, value in names if not math.isfinite(value)), "")

    def command(self, commands: Mapping[str, float]) -> None:
        """Set inputs by name; they hold until the next command."""
        for name, value in commands.items():
            self.input_vector[self.input_places[name]] = value

    def step(self, steps: int) -> bool:
        """Integrate it together with all actuators on its supply: see `Supply.step`."""
        return self.supply.step(steps)

    @property
    def path(self) -> Matrix:
        """Each channel's quantity after every step of the last tick, shape (steps, channels).

        Without a sensing element only its last row is set.
        """
        return self.supply.paths[self._place]


def on_one_supply(
    kernel: Kernel, values: Sequence[Mapping[str, float]], step: float
) -> list[Plant]:
    """Return actuators with a common pump, accumulator and lines, and equal parameters of these.

    Args:
        kernel: the model, compiled for this number of actuators.
        values: parameters of each by field name, SI; effects that are not named are off.
        step: width of an integration step [s].

    """
    supply = Supply(kernel, step)
    plants = [
        Plant(kernel, values_of_one, step, supply, place)
        for place, values_of_one in enumerate(values)
    ]
    supply.step(0)
    for _ in range(_HOLDINGS):
        for plant in plants:
            plant.hold_load()
    return plants
