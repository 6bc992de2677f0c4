"""Largest safe integration step of a configuration."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model import quantities
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import Vector, zeros
from hil_emulator.model.plant import Supply, on_one_supply
from hil_emulator.model.worst_case_states import worst_case_states

Matrix = NDArray[np.float64]

_GROWN = 0.1
"""Relative change of a parameter for the derivative of the rate (assumed)."""

_REMARKABLE = 0.5
"""Smallest part of the logarithm of a rate for which a parameter is named (assumed)."""

REACH = 2.2
"""Largest |lambda| h of a safe step: Runge-Kutta of order 4 is stable to 2.78, and up to here a
valve stalled at the stop stays within 0.1 % of range (measured)."""

_SMALL = {
    "Pa": 1e2, "m": 1e-8, "m/s": 1e-6, "A": 1e-7, "A/s": 1e-2, "m^3/s": 1e-9, "1": 1e-6, "K": 1e-3,
}  # fmt: skip
"""A small deviation of a state, by unit (assumed)."""


@dataclass(frozen=True)
class Bound:
    """The largest safe step, and its cause.

    Attributes:
        step: the step [s].
        place: number of the state's actuator on its supply.
        state: the state with the largest participation in the fastest mode.
        parameter: field of the parameter that makes the mode faster than in a usual actuator; ""
            if the mode is not faster.

    """

    step: float
    place: int
    state: str
    parameter: str


def required_step(kernel: Kernel, *values: Mapping[str, float]) -> float:
    """Return the largest step that is safe for a configuration [s].

    The bound is the fastest eigenvalue of the model in a set of worst-case states: the valve fully
    open in both directions and closed, no pressure drop at an edge, chambers near vacuum, both ends
    of the stroke and their stops, sliding and at rest. Actuators on one supply are one system, in
    states that are worst cases for all of them; two coupled actuators at all positions of both.

    Args:
        kernel: the compiled model.
        values: parameters by field name, SI, of each actuator on the supply; effects that are not
            named are off.

    """
    plants = on_one_supply(kernel, values, step=1e-6)
    return REACH / max(_fastest(plants[0].supply) for _ in worst_case_states(plants))


def step_bound(kernel: Kernel, *values: Mapping[str, float]) -> Bound:
    """Return the largest safe step as `required_step`, and what causes it."""
    plants = on_one_supply(kernel, values, step=1e-6)
    supply = plants[0].supply
    fastest, worst = 0.0, supply.states.copy()
    for _ in worst_case_states(plants):
        rate = _fastest(supply)
        if rate > fastest:
            fastest, worst = rate, supply.states.copy()
    supply.states[:] = worst
    names = kernel.state.names or ()
    place, state = divmod(_quickest_state(supply), len(names))
    return Bound(REACH / fastest, place, names[state], _cause(supply, fastest))


def _quickest_state(supply: Supply) -> int:
    """Return the state with the largest participation factor in the fastest mode."""
    values, right = np.linalg.eig(_jacobian(supply))
    mode = int(np.argmax(np.abs(values)))
    parts = np.abs(right[:, mode] * np.linalg.pinv(right)[mode])
    return int(np.argmax(parts))


def _cause(supply: Supply, fastest: float) -> str:
    """Return the parameter whose distance from its typical value most accelerates the mode.

    The distance is logarithmic, d(ln rate)/d(ln parameter) times ln(value/typical).
    """
    blame, name = _REMARKABLE, ""
    parameters, typical = supply.parameters, list(_typical(supply.kernel).items())
    for i, (field, usual) in enumerate(typical * supply.kernel.actuators):
        value = float(parameters[i])
        if not (0.0 < value < math.inf and 0.0 < usual < math.inf):
            continue
        parameters[i] = value * (1.0 + _GROWN)
        share = math.log(_fastest(supply) / fastest) / math.log1p(_GROWN)
        parameters[i] = value
        if share * math.log(value / usual) > blame:
            blame, name = share * math.log(value / usual), field
    return name


def _typical(kernel: Kernel) -> dict[str, float]:
    """Return the typical value of every parameter by field name, in the order of the record."""
    typical = {f"{t}_{p.name}": p.typical for t, ps in quantities.PARAMS.items() for p in ps}
    typical |= {e.field_of(p): p.typical for e in kernel.effects for p in e.params}
    return {field: typical[field] for field in kernel.parameters.names or ()}


def _deviations(kernel: Kernel) -> Vector:
    """Return a small deviation of each state, shape (states,)."""
    units = {q.name: q.unit for q in quantities.ALL_STATES}
    units |= {e.field_of(q): q.unit for e in kernel.effects for q in e.states}
    return np.array([_SMALL[units[name]] for name in kernel.state.names or ()])


def _jacobian(supply: Supply) -> Matrix:
    """Return the rates by the states of all actuators, in small deviations of each."""
    kernel, count = supply.kernel, supply.kernel.actuators
    scale = np.tile(_deviations(kernel), count)
    state = supply.states[: len(scale)]
    above, below = zeros(kernel.state, count), zeros(kernel.state, count)
    signals = zeros(kernel.signals, count)
    jacobian = np.empty((len(scale), len(scale)))
    for i, size in enumerate(scale):
        moved = state.copy()
        moved[i] += size
        kernel.rate(moved, above, supply.parameters, supply.inputs, signals)
        moved[i] -= 2.0 * size
        kernel.rate(moved, below, supply.parameters, supply.inputs, signals)
        jacobian[:, i] = (above - below) / (2.0 * scale)
    return jacobian


def _fastest(supply: Supply) -> float:
    """Return the largest magnitude of an eigenvalue at the actuators' states [1/s]."""
    return float(np.abs(np.linalg.eigvals(_jacobian(supply))).max())
