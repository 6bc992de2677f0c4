"""The exact linearisation of the compiled model around an equilibrium.

    dx/dt = A x + B u,    y = C x + D u

for deviations from the equilibrium, with Jacobians by central differences through `kernel.rate`.
Every effect that is on is included; states of effects that are off are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model.equilibrium import (
    Matrix,
    Model,
    NoEquilibriumError,
    approach,
    settle,
)
from hil_emulator.model.kernel import Kernel, Vector

Complex = NDArray[np.complex128]

OUTPUTS = ("hydraulic_force", "load_force", "pressure_a", "pressure_b", "position", "velocity")


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
        scales: a small deviation of each state, for conditioning.
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
        """Return the zeros of one path [rad/s]: the motions with zero output.

        With relative degree r, y = 0 implies c x = c A x = ... = c A^(r-1) x = 0. The restriction
        of A to this subspace, with the input that keeps it there, has the zeros as eigenvalues.
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

    def closed_loop_poles(self, source: str, output: str, gains: Vector) -> Complex:
        """Return the poles [rad/s] under the feedback source = -gain output, shape (gains, n)."""
        a, b, c, d = self._path(source, output)
        loops = [a - gain / (1.0 + gain * d) * np.outer(b, c) for gain in gains]
        return np.array([np.linalg.eigvals(loop) for loop in loops], dtype=np.complex128)

    @property
    def _scaled_a(self) -> Matrix:
        return self.a * self.scales / self.scales[:, None]

    def _path(self, source: str, output: str) -> tuple[Matrix, Vector, Vector, float]:
        """Return A, b, c, d of one path, in scaled states."""
        j, i = self.inputs.index(source), self.outputs.index(output)
        b, c = self.b[:, j] / self.scales, self.c[i] * self.scales
        return self._scaled_a, b, c, float(self.d[i, j])


def _linearise(model: Model, outputs: Sequence[str], layout: Sequence[str]) -> Linearisation:
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
        NoEquilibriumError: if there is no steady motion.

    """
    model = Model(kernel, values)
    model.inputs[model.input_names.index("valve_current")] = current
    model.set("position", position)
    model.set("spool_position", current)
    start, free = model.state.copy(), [n for n in model.names if n != "position"]
    try:
        settle(model, free, held_by_current=False)
    except NoEquilibriumError:
        model.state[:] = start
        approach(model)
        settle(model, free, held_by_current=False)
    return _linearise(model, outputs, kernel.signals.names or ())


def rest(
    kernel: Kernel,
    values: Mapping[str, float],
    position: float,
    outputs: Sequence[str] = OUTPUTS,
) -> Linearisation:
    """Linearise around rest at a position [m], under the current that holds the rod there.

    The bend of the seals is 0, because the share of dry friction in the force is undetermined.

    Raises:
        NoEquilibriumError: if there is no equilibrium.

    """
    model = Model(kernel, values)
    model.set("position", position)
    held = ("position", "velocity", "seal_bend")
    settle(model, [n for n in model.names if n not in held], held_by_current=True)
    return _linearise(model, outputs, kernel.signals.names or ())
