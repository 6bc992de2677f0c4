"""How small an integration step a configuration needs."""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_emulator.model import quantities
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import Vector, zeros
from hil_emulator.model.plant import Plant

Matrix = NDArray[np.float64]

_GROWN = 0.1
"""Relative change of a parameter for the slope of the rate by it (assumed)."""

_REMARKABLE = 0.5
"""Least part of the logarithm of a rate that is worth a parameter's name (assumed)."""

REACH = 2.2
"""Largest |lambda| h of a safe step: Runge-Kutta of order 4 is stable to 2.78, and up to here a
valve stalled at the stop stays within 0.1 % of range (measured)."""

RATED_CURRENT = 0.01
"""Spool position of the severe states where no saturation bounds it [A] (assumed)."""

FASTEST_ROD = 0.5
"""Speed of the rod in severe states, where the valve's flow allows as much [m/s] (assumed)."""

_SMALL = {
    "Pa": 1e2, "m": 1e-8, "m/s": 1e-6, "A": 1e-7, "A/s": 1e-2, "m^3/s": 1e-9, "1": 1e-6, "K": 1e-3,
}  # fmt: skip
"""A small deviation of a state, by unit (assumed)."""

_POPPETS = frozenset({"pilot_check_valves_open_a", "pilot_check_valves_open_b"})
"""Valves that are stiffest when they are open."""


@dataclass(frozen=True)
class Bound:
    """The largest safe step, and why it is no larger.

    Attributes:
        step: the step [s].
        state: what moves fastest in the fastest mode.
        parameter: field of the parameter that makes it faster than in a usual actuator; "" where
            it is not.

    """

    step: float
    state: str
    parameter: str


def required_step(kernel: Kernel, values: Mapping[str, float]) -> float:
    """Return the largest step that is safe for a configuration [s].

    The bound is the fastest eigenvalue of the model in a set of severe states: the valve wide
    open both ways and shut, no pressure drop at an edge, chambers near vacuum, both ends of the
    stroke and their stops, sliding and at rest.

    Args:
        kernel: the compiled model.
        values: parameters by field name, SI; effects that are not named are off.

    """
    plant = Plant(kernel, values, step=1e-6)
    return REACH / max(_fastest(plant) for _ in _severe_states(plant))


def step_bound(kernel: Kernel, values: Mapping[str, float]) -> Bound:
    """Return the largest safe step as `required_step`, and what causes it."""
    plant = Plant(kernel, values, step=1e-6)
    fastest, severest = 0.0, plant.state_vector.copy()
    for _ in _severe_states(plant):
        rate = _fastest(plant)
        if rate > fastest:
            fastest, severest = rate, plant.state_vector.copy()
    plant.state_vector[:] = severest
    return Bound(REACH / fastest, _quickest_state(plant), _cause(plant, fastest))


def _quickest_state(plant: Plant) -> str:
    """Return the state that takes the largest part in the fastest mode (participation factor)."""
    values, right = np.linalg.eig(_jacobian(plant))
    mode = int(np.argmax(np.abs(values)))
    parts = np.abs(right[:, mode] * np.linalg.pinv(right)[mode])
    return (plant.kernel.state.names or ())[int(np.argmax(parts))]


def _cause(plant: Plant, fastest: float) -> str:
    """Return the parameter whose distance from its typical value speeds the fastest mode up most.

    The distance is logarithmic, d(ln rate)/d(ln parameter) times ln(value/typical).
    """
    blame, name = _REMARKABLE, ""
    for i, (field, typical) in enumerate(_typical(plant.kernel).items()):
        value = float(plant.parameter_vector[i])
        if not (0.0 < value < math.inf and 0.0 < typical < math.inf):
            continue
        plant.parameter_vector[i] = value * (1.0 + _GROWN)
        share = math.log(_fastest(plant) / fastest) / math.log1p(_GROWN)
        plant.parameter_vector[i] = value
        if share * math.log(value / typical) > blame:
            blame, name = share * math.log(value / typical), field
    return name


def _typical(kernel: Kernel) -> dict[str, float]:
    """Return the typical value of every parameter by field name, in the order of the record."""
    typical = {f"{t}_{p.name}": p.typical for t, ps in quantities.PARAMS.items() for p in ps}
    typical |= {e.field_of(p): p.typical for e in kernel.effects for p in e.params}
    return {field: typical[field] for field in kernel.parameters.names or ()}


def _severe_states(plant: Plant) -> Iterator[None]:
    """Put the plant into one severe state after the other."""
    par, state = plant.parameters, plant.state
    p_s, p_t = float(par.supply_pressure), max(1e4, float(par.tank_pressure))
    middle = 0.5 * p_s
    pairs = ((p_s, p_t), (p_t, p_s), (middle, middle), (1e4, p_s), (p_s, 1e4))
    limit = _knob(plant, "current_saturation_limit", RATED_CURRENT)
    currents = (-limit, 0.0, limit)
    stroke, depth = float(par.cylinder_stroke), _depth(plant)
    plunger = min(_knob(plant, "cushion_plunger_length", 0.0), 0.5 * stroke)
    places = [-depth, 0.5 * stroke, stroke + depth]
    # a gap is widest where it is hardly entered
    places += [0.99 * plunger, stroke - 0.99 * plunger] if plunger else []
    gap = _knob(plant, "backlash_gap", 0.0)
    flow = float(par.valve_gain) * currents[-1] * math.sqrt(p_s)
    speeds = (0.0, min(FASTEST_ROD, flow / float(par.cylinder_piston_area)))
    for pair, current, place, speed in itertools.product(pairs, currents, places, speeds):
        plant.set_pressures(*pair)
        state.spool_position = current
        state.position = place
        state.velocity = speed
        state.stretch = gap + 1e-6
        for valve in _POPPETS.intersection(plant.kernel.state.names or ()):
            state[valve] = 1.0
        yield


def _depth(plant: Plant) -> float:
    """Return how far the rod presses into a stop under full pressure [m]; 0 without stops."""
    par = plant.parameters
    stiffness = _knob(plant, "end_stops_stiffness", 0.0)
    return float(par.supply_pressure * par.cylinder_piston_area) / stiffness if stiffness else 0.0


def _knob(plant: Plant, field: str, otherwise: float) -> float:
    """Return a parameter, if the model has it and it is finite."""
    known = field in (plant.kernel.parameters.names or ())
    value = float(plant.parameters[field]) if known else otherwise
    return value if math.isfinite(value) else otherwise


def _deviations(kernel: Kernel) -> Vector:
    """Return a small deviation of each state, shape (states,)."""
    units = {q.name: q.unit for q in quantities.ALL_STATES}
    units |= {e.field_of(q): q.unit for e in kernel.effects for q in e.states}
    return np.array([_SMALL[units[name]] for name in kernel.state.names or ()])


def _jacobian(plant: Plant) -> Matrix:
    """Return the rates by the states, in small deviations of each, shape (states, states)."""
    kernel = plant.kernel
    scale = _deviations(kernel)
    above, below = zeros(kernel.state), zeros(kernel.state)
    signals = zeros(kernel.signals)
    jacobian = np.empty((len(scale), len(scale)))
    for i, size in enumerate(scale):
        moved = plant.state_vector.copy()
        moved[i] += size
        kernel.rate(moved, above, plant.parameter_vector, plant.input_vector, signals)
        moved[i] -= 2.0 * size
        kernel.rate(moved, below, plant.parameter_vector, plant.input_vector, signals)
        jacobian[:, i] = (above - below) / (2.0 * scale)
    return jacobian


def _fastest(plant: Plant) -> float:
    """Return the largest magnitude of an eigenvalue at the plant's state [1/s]."""
    return float(np.abs(np.linalg.eigvals(_jacobian(plant))).max())
