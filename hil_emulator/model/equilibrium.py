"""The compiled model as a function, and its equilibria.

An equilibrium is a steady motion: all states but the position are constant at a given spool
position. Effects that make the balances depend strongly on the position (end stops, a stiff load
spring) permit only rest. An oscillating force permits no equilibrium.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model import quantities
from hil_emulator.model.kernel import Kernel, Vector, zeros
from hil_emulator.model.plant import Plant

Matrix = NDArray[np.float64]

SCALES = {"Pa": 1e5, "m": 1e-3, "m/s": 1e-2, "A": 1e-4, "A/s": 1.0, "N": 10.0, "m^3/s": 1e-6}
"""A small deviation of a quantity, by unit (assumed); 1e-3 for every other unit."""

STEP = 1e-4
"""Step of the central differences in scales: large relative to round-off, small relative to the
widths of the model (1e5 Pa laminar width, 1e-3 m/s friction transition, 2.8e-5 A underlap)."""

_FIRST_STEP, _GROWTH, _APPROACH_STEPS = 1e-4, 1.5, 40  # [s]; the last step is 700 s wide
_NEWTON_STEPS = 50
_HALVINGS = 12
_RATE_OF_REST = 1e-3  # largest rate that counts as zero [scales per second]


class NoEquilibriumError(ValueError):
    """The model has no rest or steady motion at this point."""


def units_of_states(kernel: Kernel) -> dict[str, str]:
    """Return the unit of every state by field name."""
    own_units = {effect.field_of(q): q.unit for effect in kernel.effects for q in effect.states}
    return {q.name: q.unit for q in quantities.ALL_STATES} | own_units


class Model:
    """The compiled model as a function of states, parameters and inputs."""

    def __init__(self, kernel: Kernel, values: Mapping[str, float]) -> None:
        plant = Plant(kernel, values, step=1e-5)
        self._kernel = kernel
        self._parameters = plant.parameter_vector
        self._signals = zeros(kernel.signals)
        self.state = plant.state_vector.copy()
        self.inputs = plant.input_vector
        names = kernel.state.names or ()
        self.active = np.flatnonzero(~np.isnan(self._all_rates())).tolist()
        self.names = [names[i] for i in self.active]
        unit_of = units_of_states(kernel)
        self.scales: Vector = np.array([SCALES.get(unit_of.get(n, ""), 1e-3) for n in self.names])
        self.input_names = kernel.inputs.names or ()
        units = [q.unit for q in quantities.INPUTS]
        self.input_scales = np.array([SCALES.get(unit, 1e-3) for unit in units])

    def set(self, name: str, value: float) -> None:
        """Set one state by name."""
        self.state[self.active[self.names.index(name)]] = value

    def _all_rates(self) -> Vector:
        """Return every state's rate; NaN for a state whose effect is off."""
        rates = np.full(len(self.state), math.nan)
        self._kernel.rate(self.state, rates, self._parameters, self.inputs, self._signals)
        return rates

    def rates(self) -> Vector:
        """Return the rates of the active states, in scales per second."""
        rates: Vector = self._all_rates()[self.active] / self.scales
        return rates

    def signals(self) -> Vector:
        """Return every signal."""
        self.rates()
        return self._signals.copy()

    def difference(
        self, function: Callable[[], Vector], memory: Vector, at: int, by: float
    ) -> Vector:
        """Return the central difference of a function of this model by a number in its memory."""
        centre = memory[at]
        memory[at] = centre + STEP * by
        above = function()
        memory[at] = centre - STEP * by
        below = function()
        memory[at] = centre
        return (above - below) / (2.0 * STEP)

    def by_states(self, function: Callable[[], Vector]) -> Matrix:
        """Return the Jacobian by the active states in scales, shape (values, states)."""
        pairs = zip(self.active, self.scales, strict=True)
        return np.array([self.difference(function, self.state, i, s) for i, s in pairs]).T

    def by_inputs(self, function: Callable[[], Vector]) -> Matrix:
        """Return the Jacobian by the inputs in scales, shape (values, inputs)."""
        pairs = enumerate(self.input_scales)
        return np.array([self.difference(function, self.inputs, i, s) for i, s in pairs]).T


def approach(model: Model) -> None:
    """Follow the motion towards its steady state with linearly implicit Euler steps.

    The position is held and the step grows, so the last steps are Newton steps. It is slower than
    Newton's method, but does not fail at corners.
    """
    moving = [i for i, name in enumerate(model.names) if name != "position"]
    places = [model.active[i] for i in moving]
    width = _FIRST_STEP
    for _ in range(_APPROACH_STEPS):
        jacobian = model.by_states(model.rates)[np.ix_(moving, moving)]
        matrix = np.eye(len(moving)) / width - jacobian
        step = np.linalg.lstsq(matrix, model.rates()[moving], rcond=None)[0]
        model.state[places] += model.scales[moving] * step
        width *= _GROWTH


def settle(model: Model, free: Sequence[str], held_by_current: bool) -> None:
    """Apply Newton's method, with halved steps if a full step increases the residual.

    Args:
        model: at a first guess; left at the equilibrium.
        free: the states that may change.
        held_by_current: whether the valve current may change too.

    Raises:
        NoEquilibriumError: if the rates do not vanish.

    """
    rows = [i for i, name in enumerate(model.names) if name != "position"]
    columns = [model.names.index(name) for name in free]
    places = [model.active[i] for i in columns]
    current = model.input_names.index("valve_current")
    for _ in range(_NEWTON_STEPS):
        residual = model.rates()[rows]
        jacobian = model.by_states(model.rates)[np.ix_(rows, columns)]
        if held_by_current:
            jacobian = np.column_stack([jacobian, model.by_inputs(model.rates)[rows, current]])
        step = -np.linalg.lstsq(jacobian, residual, rcond=1e-13)[0]
        if np.max(np.abs(step)) < 1e-9 and np.max(np.abs(residual)) < _RATE_OF_REST:
            return
        state, inputs = model.state.copy(), model.inputs.copy()
        for _ in range(_HALVINGS):
            model.state[places] = state[places] + model.scales[columns] * step[: len(places)]
            if held_by_current:
                model.inputs[current] = inputs[current] + model.input_scales[current] * step[-1]
            if np.linalg.norm(model.rates()[rows]) < np.linalg.norm(residual):
                break
            step *= 0.5
    raise NoEquilibriumError("no equilibrium found: is a pressure, a spring or a stop in the way?")
