"""States in which a model is stiffest, for the largest safe step."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from hil_emulator.model.plant import Plant
from hil_emulator.model.rating import REFERENCE_CURRENT

FASTEST_ROD = 0.5
"""Speed of the rod in worst-case states, if the valve's flow allows it [m/s] (assumed)."""

_POPPETS = frozenset({"pilot_check_valves_open_a", "pilot_check_valves_open_b"})
"""Valves that are stiffest when they are open."""


@dataclass(frozen=True)
class _WorstCase:
    """The worst case for one actuator: pressures of its chambers, currents, places, speeds."""

    pressures: Sequence[tuple[float, float]]
    currents: Sequence[float]
    speeds: Sequence[float]
    places: Sequence[float]


def _worst_case(plant: Plant) -> _WorstCase:
    par = plant.parameters
    p_s, p_t = float(par.supply_pressure), max(1e4, float(par.tank_pressure))
    middle = 0.5 * p_s
    limit = _knob(
        plant, "current_saturation_limit", _knob(plant, "spool_stops_limit", REFERENCE_CURRENT)
    )
    stroke, depth = float(par.cylinder_stroke), _depth(plant)
    plunger = min(_knob(plant, "cushion_plunger_length", 0.0), 0.5 * stroke)
    # the flow of a gap is largest at the start of the plunger's entry
    entered = (0.99 * plunger, stroke - 0.99 * plunger) if plunger else ()
    flow = float(par.valve_gain) * limit * math.sqrt(p_s)
    return _WorstCase(
        pressures=((p_s, p_t), (p_t, p_s), (middle, middle), (1e4, p_s), (p_s, 1e4)),
        currents=(-limit, 0.0, limit),
        speeds=(0.0, min(FASTEST_ROD, flow / float(par.cylinder_piston_area))),
        places=(-depth, 0.5 * stroke, stroke + depth, *entered),
    )


def _together(places: Sequence[Sequence[float]]) -> Iterator[Sequence[float]]:
    """Yield a position for each actuator: all combinations for two, equal indices for more."""
    if len(places) <= 2:
        yield from itertools.product(*places)
        return
    for i in range(max(map(len, places))):
        yield [options[i % len(options)] for options in places]


def worst_case_states(plants: Sequence[Plant]) -> Iterator[None]:
    """Put the plants of one supply into one worst-case state after the other."""
    worst = [_worst_case(plant) for plant in plants]
    for i, j, k in itertools.product(range(5), range(3), range(2)):
        for places in _together([case.places for case in worst]):
            for plant, case, place in zip(plants, worst, places, strict=True):
                _put(plant, case.pressures[i], case.currents[j], case.speeds[k], place)
            yield


def _put(
    plant: Plant, pressures: tuple[float, float], current: float, speed: float, place: float
) -> None:
    state = plant.state
    plant.set_pressures(*pressures)
    state.spool_position = current
    state.position = place
    state.velocity = speed
    state.stretch = _knob(plant, "backlash_gap", 0.0) + 1e-6
    for valve in _POPPETS.intersection(plant.kernel.state.names or ()):
        state[valve] = 1.0


def _depth(plant: Plant) -> float:
    """Return the depth of the rod in a stop under full pressure [m]; 0 without stops."""
    par = plant.parameters
    stiffness = _knob(plant, "end_stops_stiffness", 0.0)
    return float(par.supply_pressure * par.cylinder_piston_area) / stiffness if stiffness else 0.0


def _knob(plant: Plant, field: str, otherwise: float) -> float:
    """Return a parameter, if the model has it and it is finite."""
    exists = field in (plant.kernel.parameters.names or ())
    value = float(plant.parameters[field]) if exists else otherwise
    return value if math.isfinite(value) else otherwise
