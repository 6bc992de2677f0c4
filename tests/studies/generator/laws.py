"""Laws of the blind plant: each hidden effect as text books print it, and in a foreign form.

Friction is regularised by a root, orifices by a cubic blend; narrow ones creep. `p` is a
`plant.Machine` everywhere.
"""

import math
from typing import Any

import numba

ATMOSPHERE = 1.01325e5
STRIBECK_SPEED = 0.02
"""Speed over which breakaway friction fades [m/s]."""
LOOP = 2e-4
"""Current within which a hysteresis loop changes its side [A]."""


@numba.njit
def orifice(drop: float) -> float:
    """Return the root of a pressure drop, a cubic through zero below 1 bar."""
    a = abs(drop)
    if a >= 1e5:
        return math.copysign(math.sqrt(a), drop)
    r = drop / 1e5
    return math.sqrt(1e5) * r * (1.25 - 0.25 * r * r)


SLOT, DISCHARGE, DENSITY, VISCOSITY = 0.025, 0.6, 850.0, 46e-6 * 850.0
"""Height of the edges' slots [m/A], turbulent discharge coefficient, and the oil."""
CREEPING = math.pi / 32.0 * SLOT / VISCOSITY * math.sqrt(0.5 * DENSITY) / DISCHARGE
"""Flow that creeps through a slit, pi x² w dp/(32 mu), over K_v u² dp [1/(A Pa^0.5)]."""


ROOT, CREEPS, SMOOTH = 0, 1, 2
"""Forms of an edge: turbulent at any opening; the less of both flows; both resistances in row."""


@numba.njit
def metered(p: Any, opening: float, drop: float) -> float:
    """Return the flow through an edge, by one of three forms."""
    turbulent = opening * orifice(drop)
    if turbulent == 0.0 or p.edge_form == ROOT:
        return p.kv * turbulent
    share = turbulent / (p.creep * CREEPING * opening * opening * drop)
    if p.edge_form == SMOOTH:
        return p.kv * turbulent / (math.sqrt(1.0 + 0.25 * share**2) + 0.5 * share)
    return p.kv * turbulent / (1.0 + share**4) ** 0.25


@numba.njit
def edge(p: Any, travel: float, sense: float) -> float:
    """Return the opening of a metering edge.

    Foreign: smooth laps, gains that part with the opening, flow that bends early.

    Args:
        p: the machine.
        travel: of the spool in the sense in which the edge opens [A].
        sense: on which side of null the spool is, 1 or -1.

    """
    side = p.gain_asymmetry * (abs(travel) / 1.5e-3 if p.foreign else 1.0)
    opening = travel * (1.0 + side * sense) - p.overlap
    if p.foreign and p.overlap > 0.0:
        width = 0.5 * p.overlap
        opening = width * math.log1p(math.exp(min((opening + p.clearance) / width, 500.0)))
    elif opening > 0.0:
        opening += p.clearance
    else:  # creeping past closed lands falls as 1/(way + clearance/2)
        opening = p.clearance * math.sqrt(p.clearance / (p.clearance - 2.0 * opening))
    if p.flow_saturation == 0.0:
        return opening
    ratio = opening * p.flow_saturation
    return opening / (1.0 + 0.35 * ratio) if p.foreign else opening / math.sqrt(1.0 + ratio**2)


GASSY, CONSTANT, STIFFENS = 0, 1, 2
"""Forms of the oil: with free air, with one modulus, with one that rises with pressure."""
MIDDLE_PRESSURE = 80e5
"""Pressure at which a rising modulus is that of the machine [Pa]."""


@numba.njit
def stiffness(p: Any, pressure: float) -> float:
    """Return the modulus of oil with a little free air, compressed adiabatically."""
    if p.oil_form == CONSTANT:
        return p.beta
    if p.oil_form == STIFFENS:
        return p.beta * (0.8 + 0.2 * min(max(pressure, 0.0) / MIDDLE_PRESSURE, 2.0))
    absolute = max(pressure, 1e3)
    gas = p.air * (ATMOSPHERE / absolute) ** (1.0 / 1.4)
    return p.beta * (1.0 + gas) / (1.0 + gas * p.beta / (1.4 * absolute))


@numba.njit
def past_piston(p: Any, drop: float, x: float) -> float:
    """Return the leakage from a to b; foreign: a hole instead of a gap."""
    if p.foreign:
        flow = p.internal_leakage * math.sqrt(40e5) * orifice(drop)
    else:
        flow = p.internal_leakage * drop
    flow += p.place_leak * drop * max(0.0, (x / p.stroke - 0.5) / 0.125)
    over = abs(drop) - 20e5
    return flow + p.crack_leak * math.copysign(max(0.0, over), drop)


@numba.njit
def outside(p: Any, pressure: float) -> float:
    """Return the leakage of a chamber to the surroundings; foreign: a hole instead of a gap."""
    over = max(0.0, pressure - ATMOSPHERE)
    if p.foreign:
        return p.external_leakage * math.sqrt(80e5) * orifice(over)
    return p.external_leakage * over


@numba.njit
def return_pressure(p: Any, flow: float) -> float:
    """Return the tank pressure at the valve; foreign: a laminar line."""
    size = p.usual_flow if p.foreign else abs(flow)
    return p.tank + p.back_pressure * flow * size


BENT, TANH, DAHL = 0, 1, 2
"""Forms of dry friction: by a root of bend and speed, by speed alone, by a bend that yields."""


@numba.njit
def way_of(p: Any, v: float, bend: float) -> float:
    """Return the part of dry friction that opposes the motion, -1 to 1."""
    if p.dry_form == TANH:
        return math.tanh(v / p.slip_speed)
    if p.dry_form == DAHL:
        return min(max(bend, -1.0), 1.0)
    pushed = bend + v / p.slip_speed
    return pushed / math.sqrt(math.sqrt(pushed**4 + 1.0))


@numba.njit
def bends(p: Any, v: float, bend: float) -> float:
    """Return the rate of the seals' bend over their shear length."""
    if p.dry_form == DAHL:
        return v / p.shear * (1.0 - math.copysign(1.0, v) * bend)
    return v / p.shear


@numba.njit
def friction(p: Any, v: float, x: float, bend: float, pa: float, pb: float) -> float:
    """Return the friction of the seals, whose bend over their shear length holds a rod at rest.

    Foreign: breakaway fades as a Lorentz curve, pressure acts by its difference, direction on the
    viscous part alone, position linearly from the middle.
    """
    direction = way_of(p, v, bend)
    place = 2.0 * x / p.stroke - 1.0
    if p.foreign:
        dry = p.coulomb + p.stribeck / (1.0 + (v / STRIBECK_SPEED) ** 2)
        dry += p.pressure_friction * 1.6 * abs(pa - pb)
        force = dry * direction + p.viscous * v
        force += 2.0 * p.friction_asymmetry * p.viscous * abs(v)
        force *= 1.0 + p.position_friction * abs(place)
    else:
        dry = p.coulomb + p.stribeck * math.exp(-abs(v) / STRIBECK_SPEED)
        dry += p.pressure_friction * (pa + pb)
        force = dry * direction + p.viscous * v
        force *= 1.0 + p.friction_asymmetry * direction
        force *= 1.0 + p.position_friction * place**2
    force *= 1.0 + p.ripple * math.sin(2.0 * math.pi * x / 3.7e-3)
    force += p.jam * math.exp(-(((x / p.stroke - 0.5375) / 0.01875) ** 2)) * direction
    return force + p.drag * v * abs(v)


@numba.njit
def surroundings(p: Any, x: float, v: float, t: float) -> float:
    """Return the force against the load; foreign: a hardening spring, a weight on a lever."""
    gap = x - 0.5 * p.stroke
    if p.foreign:
        bent, turned = gap / (0.1875 * p.stroke), 3.2 * gap / p.stroke
        force = p.load_spring * gap * bent**2 + p.gravity * math.cos(turned)
    else:
        force = p.load_spring * gap + p.gravity
    if 0.8 < t % 1.6 < 1.1:
        force += p.burst
    return force + p.load_viscous * v + p.one_way_damper * max(0.0, v) ** 2


@numba.njit
def bias(p: Any, t: float) -> float:
    """Return how far the null is off; foreign: wandering."""
    return p.null_bias * (1.0 + (0.4 * math.sin(2.0 * (p.since + t)) if p.foreign else 0.0))


@numba.njit
def loop(side: float, change: float) -> float:
    """Return the side of a hysteresis loop after a change of current (Dahl), -1 to 1."""
    end = math.copysign(1.0, change)
    return end + (side - end) * math.exp(-abs(change) / LOOP)


@numba.njit
def plays(width: float, play: Any, u: float) -> float:
    """Return a set point behind four play elements in parallel: the foreign hysteresis."""
    total = 0.0
    for i in range(len(play)):
        half = 0.2 * width * (i + 1)
        play[i] = min(max(play[i], u - half), u + half)
        total += play[i] / len(play)
    return total
