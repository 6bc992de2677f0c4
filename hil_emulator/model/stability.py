"""How small an integration step a configuration needs."""

import itertools
import math
from collections.abc import Iterator, Mapping

import numpy as np

from hil_emulator.model import quantities
from hil_emulator.model.kernel import Kernel
from hil_emulator.model.layout import Vector, zeros
from hil_emulator.model.plant import Plant

REACH = 2.2
"""Largest |lambda| h of a safe step: Runge-Kutta of order 4 is stable to 2.78, and up to here a
valve stalled at the stop stays within 0.1 % of range (measured)."""

RATED_CURRENT = 0.01
"""Spool position of the severe states where no saturation bounds it [A] (assumed)."""

_SMALL = {"Pa": 1e2, "m": 1e-8, "m/s": 1e-6, "A": 1e-7, "A/s": 1e-2, "m^3/s": 1e-9, "1": 1e-6}
"""A small deviation of a state, by unit (assumed)."""


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
    fastest = max(_fastest(plant) for _ in _severe_states(plant))
    return REACH / fastest


def _severe_states(plant: Plant) -> Iterator[None]:
    """Put the plant into one severe state after the other."""
    par, state = plant.parameters, plant.state
    p_s, p_t = float(par.supply_pressure), max(1e4, float(par.tank_pressure))
    middle = 0.5 * p_s
    pairs = ((p_s, p_t), (p_t, p_s), (middle, middle), (1e4, p_s), (p_s, 1e4))
    limit = _knob(plant, "current_saturation_limit", RATED_CURRENT)
    currents = (-limit, 0.0, limit)
    stroke, area_a = float(par.cylinder_stroke), float(par.cylinder_piston_area)
    area_b = area_a * float(par.cylinder_area_ratio)
    places = (
        -_depth(plant, float(par.cylinder_dead_volume_a) / area_a),
        0.5 * stroke,
        stroke + _depth(plant, float(par.cylinder_dead_volume_b) / area_b),
    )
    gap = _knob(plant, "backlash_gap", 0.0)
    for pair, current, place, speed in itertools.product(pairs, currents, places, (0.0, 0.5)):
        plant.set_pressures(*pair)
        state.spool_position = current
        state.position = place
        state.velocity = speed
        state.stretch = gap + 1e-6
        yield


def _depth(plant: Plant, free: float) -> float:
    """Return how far the rod goes beyond an end under full pressure [m].

    Args:
        plant: the actuator.
        free: way on which the chamber behind has some volume left [m].

    """
    par = plant.parameters
    stiffness = _knob(plant, "end_stops_stiffness", 0.0)
    if stiffness == 0.0:
        return free
    return min(free, float(par.supply_pressure * par.cylinder_piston_area) / stiffness)


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


def _fastest(plant: Plant) -> float:
    """Return the largest magnitude of an eigenvalue at the plant's state [1/s]."""
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
    return float(np.abs(np.linalg.eigvals(jacobian)).max())
