"""States of a model that are active at some parameters, and its largest eigenvalue."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.model_run.run import INPUT_COUNT
from hil_emulator.model import quantities
from hil_emulator.model.declare import Effect, is_on
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.stages import (
    CONTINUOUS,
    coupling_acts,
    dry_friction_acts,
    holding_acts,
    source_acts,
)

USUAL_SPEED = 0.1
"""Typical speed of the rod [m/s] (assumed)."""

SHARED_STATES = (
    (dry_friction_acts, quantities.FRICTION_STATES),
    (source_acts, quantities.SUPPLY_STATES),
    (holding_acts, quantities.HOLDING_STATES),
    (coupling_acts, quantities.COUPLING_STATES),
)
"""States that are active only if an effect of a stage is on."""

_TINY = {"pressure_a": 1.0, "pressure_b": 1.0, "pump_pressure": 1.0}
"""Finite difference steps of pressures [Pa]; other states have 1e-7 of their unit."""


class ActiveStates:
    """The active states of a compiled model.

    Args:
        kernel: the model.

    """

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._states = list(kernel.state.names or ())
        at = {name: i for i, name in enumerate(kernel.parameters.names or ())}
        moving = [e for e in kernel.effects if e.stage in CONTINUOUS]
        self._movers = [_mover(e, at[e.field_of(e.knob)]) for e in moving]

    def active(self, par: Array) -> list[str]:
        """Return the active states: those of every actuator and of the acting effects."""
        acting = [m for m in self._movers if is_on(m[0], float(par[m[1]]))]
        at = {law.stage.name for effect, _, _ in acting for law in effect.laws}
        states = [q.name for q in quantities.STATES]
        for acts, moved in SHARED_STATES:
            if acts.stage.name in at:
                states += [q.name for q in moved]
        return states + [name for _, _, names in acting for name in names]

    def fastest(self, par: Array, rest: Array) -> float:
        """Return the largest eigenvalue at rest and at the typical speed [rad/s]."""
        rows = [self._states.index(n) for n in self.active(par)]
        return max(self._spectral_radius(par, rest, rows, v) for v in (0.0, USUAL_SPEED))

    def _spectral_radius(
        self, par: Array, rest: Array, rows: Sequence[int], velocity: float
    ) -> float:
        rate, state = self._kernel.rate, rest.copy()
        state[self._states.index("velocity")] = velocity
        inputs, signals = np.zeros(INPUT_COUNT), np.zeros(len(self._kernel.signals.names or ()))
        base, moved = np.zeros(len(state)), np.zeros(len(state))
        rate(state, base, par, inputs, signals)
        jacobian = np.zeros((len(rows), len(rows)))
        for j, row in enumerate(rows):
            other = state.copy()
            other[row] += _TINY.get(self._states[row], 1e-7)
            rate(other, moved, par, inputs, signals)
            jacobian[:, j] = (moved - base)[rows] / (other[row] - state[row])
        if not np.isfinite(jacobian).all():
            return float("inf")
        return float(np.max(np.abs(np.linalg.eigvals(jacobian))))


def _mover(effect: Effect, knob: int) -> tuple[Effect, int, list[str]]:
    """Return an effect, its knob's index and its states."""
    return effect, knob, [effect.field_of(q) for q in effect.states]
