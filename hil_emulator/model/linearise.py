"""The exact linearisation of the compiled model around an equilibrium it finds itself.

    dx/dt = A x + B u,    y = C x + D u

for deviations from the equilibrium, with Jacobians by central differences through `kernel.rate`.
Every effect that is on takes part; states of effects that are off are left out.

An equilibrium is a steady motion: everything but the position rests at a given spool position.
Beyond its validity: effects that make the balances depend strongly on the position (end stops, a
stiff load spring) know no steady motion but rest.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model import actuator
from hil_emulator.model.kernel import Kernel, Vector, zeros
from hil_emulator.model.plant import Plant

Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SCALES = {"Pa": 1e5, "m": 1e-3, "m/s": 1e-2, "A": 1e-4, "A/s": 1.0, "N": 10.0}
"""A small deviation of a quantity, by unit (assumed); 1e-3 for every other unit."""

_STEP = 1e-4
"""Step of the central differences in scales: large against round-off, small against the model's
own widths (1e5 Pa laminar width, 1e-3 m/s friction transition, 2.8e-5 A underlap)."""

_NEWTON_STEPS = 50
_HALVINGS = 12

OUTPUTS = ("hydraulic_force", "load_force", "pressure_a", "pressure_b", "position", "velocity")


class NoEquilibriumError(ValueError):
    """The model does not come to rest or to a steady motion at the point asked for."""


@dataclass(frozen=True)
class Linearisation:
    """A linear state space with names.

    Attributes:
        states: names, shape (n,).
        inputs: names, shape (m,).
        outputs: names, shape (p,).
        a: dx/dt by x, shape (n, n).
        b: dx/dt by u, shape (n, m).
        c: y by x, shape (p, n).
        d: y by u, shape (p, m).
        scales: a small deviation of each state; divides them for sound arithmetic.
        equilibrium: the state around which it holds, by name, SI.
        signals: every signal there, by name, SI.
        current: the valve current that holds it [A].

    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix
    scales: Vector
    equilibrium: Mapping[str, float]
    signals: Mapping[str, float]
    current: float

    @property
    def poles(self) -> Complex:
        """Eigenvalues of A [rad/s], slowest first."""
        values = np.linalg.eigvals(self._scaled_a).astype(np.complex128)
        return values[np.argsort(np.abs(values))]

    def response(self, source: str, output: str, omega: Vector) -> Complex:
        """Return the frequency response at angular frequencies [rad/s], shape (k,)."""
        a, b, c, d = self._path(source, output)
        eye = np.eye(len(a))
        values = [c @ np.linalg.solve(1j * w * eye - a, b) + d for w in omega]
        return np.array(values, dtype=np.complex128)

    def zeros(self, source: str, output: str) -> Complex:
        """Return the zeros of one path [rad/s]: the motions that leave its output at rest.

        With relative degree r, y = 0 holds c x = c A x = ... = c A^(r-1) x = 0; what is left of A
        there, under the input that keeps it so, has the zeros as eigenvalues.
        """
        a, b, c, d = self._path(source, output)
        if d != 0.0:
            return np.linalg.eigvals(a - np.outer(b, c) / d).astype(np.complex128)
        rows, row = [c], c @ a
        while abs(rows[-1] @ b) <= 1e-9 * np.linalg.norm(rows[-1]) * np.linalg.norm(b):
            if len(rows) == len(a):
                raise ValueError(f"{source} does not reach {output}")
            rows.append(row)
            row = row @ a
        held = a - np.outer(b, row) / (rows[-1] @ b)
        level = np.array([r / np.linalg.norm(r) for r in rows])
        rest = np.linalg.svd(level)[2][len(rows) :].T
        values = np.linalg.eigvals(rest.T @ held @ rest).astype(np.complex128)
        return values[np.argsort(np.abs(values))]

    @property
    def _scaled_a(self) -> Matrix:
        return self.a * self.scales / self.scales[:, None]

    def _path(self, source: str, output: str) -> tuple[Matrix, Vector, Vector, float]:
        """Return A, b, c, d of one path, in scaled states."""
        j, i = self.inputs.index(source), self.outputs.index(output)
        b, c = self.b[:, j] / self.scales, self.c[i] * self.scales
        return self._scaled_a, b, c, float(self.d[i, j])


def _units(kernel: Kernel) -> dict[str, str]:
    """Return the unit of every state by field name."""
    own = {effect.field_of(q): q.unit for effect in kernel.effects for q in effect.states}
    shared = (*actuator.STATES, *actuator.SUPPLY_STATES, *actuator.COUPLING_STATES)
    return {q.name: q.unit for q in shared} | own


class _Model:
    """The compiled model as a function of its active states and the valve current."""

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
        unit_of = _units(kernel)
        self.scales: Vector = np.array([_SCALES.get(unit_of.get(n, ""), 1e-3) for n in self.names])
        self.input_names = kernel.inputs.names or ()
        units = [q.unit for q in actuator.INPUTS]
        self.input_scales = np.array([_SCALES.get(unit, 1e-3) for unit in units])

    def set(self, name: str, value: float) -> None:
        """Set one state by name."""
        self.state[self.active[self.names.index(name)]] = value

    def _all_rates(self) -> Vector:
        """Return every state's rate; that of a state whose effect is off is not a number."""
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
        """Return the central difference of a function of this model by one number in its memory."""
        centre = memory[at]
        memory[at] = centre + _STEP * by
        above = function()
        memory[at] = centre - _STEP * by
        below = function()
        memory[at] = centre
        return (above - below) / (2.0 * _STEP)

    def by_states(self, function: Callable[[], Vector]) -> Matrix:
        """Return the Jacobian by the active states in scales, shape (values, states)."""
        pairs = zip(self.active, self.scales, strict=True)
        return np.array([self.difference(function, self.state, i, s) for i, s in pairs]).T

    def by_inputs(self, function: Callable[[], Vector]) -> Matrix:
        """Return the Jacobian by the inputs in scales, shape (values, inputs)."""
        pairs = enumerate(self.input_scales)
        return np.array([self.difference(function, self.inputs, i, s) for i, s in pairs]).T


def _settle(model: _Model, free: Sequence[str], held_by_current: bool) -> None:
    """Newton's method, with halved steps where a full one leads away, until the rates vanish."""
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
        if np.max(np.abs(step)) < 1e-9:
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


def _linearise(model: _Model, outputs: Sequence[str], layout: Sequence[str]) -> Linearisation:
    chosen = [layout.index(name) for name in outputs]
    s, u = model.scales, model.input_scales
    return Linearisation(
        states=tuple(model.names),
        inputs=tuple(model.input_names),
        outputs=tuple(outputs),
        a=model.by_states(model.rates) * s[:, None] / s,
        b=model.by_inputs(model.rates) * s[:, None] / u,
        c=model.by_states(model.signals)[chosen] / s,
        d=model.by_inputs(model.signals)[chosen] / u,
        scales=s,
        equilibrium=dict(zip(model.names, model.state[model.active].tolist(), strict=True)),
        signals=dict(zip(layout, model.signals().tolist(), strict=True)),
        current=float(model.inputs[model.input_names.index("valve_current")]),
    )


def steady_motion(
    kernel: Kernel,
    values: Mapping[str, float],
    current: float,
    position: float,
    outputs: Sequence[str] = OUTPUTS,
) -> Linearisation:
    """Linearise around the steady motion that a valve current [A] causes at a position [m].

    Raises:
        NoEquilibriumError: if there is none.

    """
    model = _Model(kernel, values)
    model.inputs[model.input_names.index("valve_current")] = current
    model.set("position", position)
    model.set("spool_position", current)
    _settle(model, [n for n in model.names if n != "position"], held_by_current=False)
    return _linearise(model, outputs, kernel.signals.names or ())


def rest(
    kernel: Kernel,
    values: Mapping[str, float],
    position: float,
    outputs: Sequence[str] = OUTPUTS,
) -> Linearisation:
    """Linearise around rest at a position [m], under the current that holds the rod there.

    Raises:
        NoEquilibriumError: if there is none.

    """
    model = _Model(kernel, values)
    model.set("position", position)
    _settle(
        model, [n for n in model.names if n not in ("position", "velocity")], held_by_current=True
    )
    return _linearise(model, outputs, kernel.signals.names or ())
