"""An actuator written a second time, apart from the package: own equations, Heun, 10 us."""

import math
from typing import NamedTuple

import numba
import numpy as np

from tests.studies.generator.laws import (
    BENT,
    CREEPS,
    GASSY,
    bends,
    bias,
    edge,
    friction,
    loop,
    metered,
    outside,
    past_piston,
    plays,
    return_pressure,
    stiffness,
    surroundings,
)

STEP = 1e-5
"""Integration step [s]: a tenth of what the search may take, and less."""

SUPPLY_VOLUME = 1e-3
"""Volume of the pressure line [m^3]."""

PUMP_DROOP = 10e5
"""Pressure between no and full stroke of the pump's compensator [Pa]."""


class Machine(NamedTuple):
    """Parameters of one real machine, SI; from `null_bias` on they are effects, zero without.

    The last seven are the forms of its base laws, and numbers that no data sheet states.
    `since` is the time for which it has been running when an experiment begins [s]: a wander does
    not begin with it.
    """

    supply: float
    tank: float
    kv: float
    wv: float
    zv: float
    area: float
    alpha: float
    stroke: float
    va: float
    vb: float
    beta: float
    mass: float
    viscous: float
    coulomb: float
    load_viscous: float
    clearance: float
    air: float
    ripple: float
    foreign: bool
    spool_rate: float = 3.6
    usual_flow: float = 1.5e-5
    null_bias: float = 0.0
    overlap: float = 0.0
    gain_asymmetry: float = 0.0
    flow_saturation: float = 0.0
    hysteresis: float = 0.0
    variable_pump: float = 0.0
    back_pressure: float = 0.0
    internal_leakage: float = 0.0
    external_leakage: float = 0.0
    stribeck: float = 0.0
    friction_asymmetry: float = 0.0
    pressure_friction: float = 0.0
    position_friction: float = 0.0
    load_spring: float = 0.0
    gravity: float = 0.0
    place_leak: float = 0.0
    crack_leak: float = 0.0
    blocked_spool: float = 0.0
    jam: float = 0.0
    drag: float = 0.0
    burst: float = 0.0
    one_way_damper: float = 0.0
    since: float = 0.0
    edge_form: int = CREEPS
    creep: float = 1.0
    oil_form: int = GASSY
    dry_form: int = BENT
    shear: float = 2e-5
    slip_speed: float = 1e-3
    motor_lag: float = 0.0


STATES = ("spool", "spool speed", "oil in a", "oil in b", "position", "velocity", "return flow",
          "pump pressure", "pump flow", "bend of the seals", "torque motor")  # fmt: skip
"""What is integrated; the pump's pressure is counted from the set one."""

VACUUM = 1e3
"""Pressure of a void [Pa]."""

SLIDING = 3.0
"""How many times their shear length seals bend until they slide."""


def at_rest(p: Machine) -> tuple[np.ndarray, np.ndarray]:
    """Return the state at rest in the middle of the stroke, and the memory of hysteresis."""
    s = np.zeros(len(STATES))
    s[2] = p.alpha / (1.0 + p.alpha) * p.supply + p.gravity / p.area
    s[3] = p.supply / (1.0 + p.alpha)
    s[4] = 0.5 * p.stroke
    return s, np.zeros(6)


@numba.njit
def pressure(oil):
    """Return the pressure of a chamber from its state, which goes on falling as a void grows.

    The void has to be filled before the pressure rises: no oil is lost or made.
    """
    return max(oil, VACUUM)


@numba.njit
def rates(p, s, u, supply, t, out):
    """Fill the rates of the states; return the force on the rod's end."""
    spool, speed, oil_a, oil_b, x, v, returned, sag, stroke, bend, _ = s
    pa, pb = pressure(oil_a), pressure(oil_b)
    out[0] = max(-p.spool_rate, min(p.spool_rate, speed))
    out[10] = (u - s[10]) / p.motor_lag if p.motor_lag > 0.0 else 0.0
    target = s[10] if p.motor_lag > 0.0 else u
    out[1] = p.wv**2 * (target - spool) - 2.0 * p.zv * p.wv * speed
    travel = spool
    if p.blocked_spool > 0.0:
        travel = min(travel, p.blocked_spool)
    source = supply + sag
    tank = return_pressure(p, returned)
    opens, closes = _edges(p, travel)
    qsa, qbt = metered(p, opens, source - pa), metered(p, opens, pb - tank)
    qsb, qat = metered(p, closes, source - pb), metered(p, closes, pa - tank)
    leak = past_piston(p, pa - pb, x)
    va = p.va + p.area * x
    vb = p.vb + p.alpha * p.area * (p.stroke - x)
    out[2] = stiffness(p, pa) / va * (qsa - qat - leak - outside(p, pa) - p.area * v)
    out[3] = stiffness(p, pb) / vb * (qsb - qbt + leak - outside(p, pb) + p.alpha * p.area * v)
    net = p.area * (pa - p.alpha * pb) - friction(p, v, x, bend, pa, pb)
    over = max(0.0, x - p.stroke) - max(0.0, -x)
    net -= 5e10 * over * abs(over)
    out[4] = v
    out[5] = (net - surroundings(p, x, v, t)) / p.mass
    out[6] = (qat + qbt - returned) / 1e-3
    out[9] = bends(p, v, bend)
    out[7], out[8] = _pump(p, sag, stroke, qsa + qsb)
    return net


@numba.njit
def _edges(p, travel):
    """Return the openings of both pairs of edges."""
    sense = math.copysign(1.0, travel)
    return edge(p, travel, sense), edge(p, -travel, sense)


@numba.njit
def _pump(p, sag, stroke, drawn):
    """Return the rates of pressure and flow of a compensated pump; foreign: a square droop."""
    if p.variable_pump == 0.0:
        return 0.0, 0.0
    if p.foreign:
        goal = -PUMP_DROOP * p.variable_pump**2 * drawn * abs(drawn)
        return (goal - sag) / 0.02, 0.0
    wanted = max(0.0, min(1.0, -sag / PUMP_DROOP)) / p.variable_pump
    return p.beta / SUPPLY_VOLUME * (stroke - drawn), (wanted - stroke) / 0.02


@numba.njit
def advance(p, s, memory, u, supply, t, steps):
    """Integrate one sample with the set point held; return the force on the rod's end.

    `memory` holds four play elements, the side of the hysteresis loop and the last set point.
    """
    first, second = np.zeros(len(s)), np.zeros(len(s))
    memory[4], memory[5] = loop(memory[4], u - memory[5]), u
    looped = u - 0.5 * p.hysteresis * memory[4]
    target = plays(p.hysteresis, memory[:4], u) if p.foreign else looped
    for k in range(steps):
        now = t + k * STEP
        rates(p, s, target + bias(p, now), supply, now, first)
        rates(p, s + STEP * first, target + bias(p, now), supply, now + STEP, second)
        s += 0.5 * STEP * (first + second)
        s[9] = min(max(s[9], -SLIDING), SLIDING)
    end = t + steps * STEP
    return rates(p, s, target + bias(p, end), supply, end, first)
