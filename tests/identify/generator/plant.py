"""An actuator written a second time, apart from the package: own equations, Heun's method, 10 us.

Every effect exists in two laws: the one that text books print first, and a foreign one. Friction is
regularised by a root, orifices by a cubic blend, stops by a quadratic spring.
"""

import math

import numba
import numpy as np

STEP = 1e-5
"""Integration step [s]."""

FIELDS = (
    "supply", "tank", "kv", "wv", "zv", "area", "alpha", "stroke", "va", "vb", "beta", "mass",
    "viscous", "coulomb", "load_viscous", "underlap", "air", "ripple",
    "null_bias", "overlap", "gain_asymmetry", "internal_leakage", "external_leakage",
    "more_air", "back_pressure", "stribeck", "friction_asymmetry", "pressure_friction",
    "position_friction", "load_spring", "gravity", "hysteresis",
    "place_leak", "jam", "drag", "burst",
    "foreign",
)  # fmt: skip
"""Parameters, in the order of the vector."""

AT = {name: i for i, name in enumerate(FIELDS)}
(SUPPLY, TANK, KV, WV, ZV, AREA, ALPHA, STROKE, VA, VB, BETA, MASS, VISCOUS, COULOMB, LOAD_VISCOUS,
 UNDERLAP, AIR, RIPPLE, NULL_BIAS, OVERLAP, GAIN_ASYMMETRY, INTERNAL, EXTERNAL, MORE_AIR, BACK,
 STRIBECK, FRICTION_ASYMMETRY, PRESSURE_FRICTION, POSITION_FRICTION, LOAD_SPRING, GRAVITY,
 HYSTERESIS, PLACE_LEAK, JAM, DRAG, BURST, FOREIGN) = range(len(FIELDS))  # fmt: skip


@numba.njit
def orifice(drop: float) -> float:
    """Return the root of a pressure drop, a cubic through zero below 1 bar."""
    a = abs(drop)
    if a >= 1e5:
        return math.copysign(math.sqrt(a), drop)
    r = drop / 1e5
    return math.sqrt(1e5) * r * (1.25 - 0.25 * r * r)


@numba.njit
def edge(p, opening):
    """Return the opening of an edge under lap, in both laws."""
    lap = p[OVERLAP]
    if p[FOREIGN] > 0.5 and lap > 0.0:
        width = 0.5 * lap
        return width * math.log1p(math.exp(min((opening - lap) / width, 500.0))) + p[UNDERLAP]
    return max(0.0, opening - lap + p[UNDERLAP])


@numba.njit
def stiffness(p, pressure):
    """Return the bulk modulus with free air, in both laws."""
    absolute = max(pressure, 1e3)
    r = p[AIR] + p[MORE_AIR]
    if p[FOREIGN] > 0.5 and p[MORE_AIR] > 0.0:
        r = p[AIR] + p[MORE_AIR] * max(0.0, 1.0 - absolute / 40e5)
        gas = r * (1.01325e5 / absolute)
        return p[BETA] / (1.0 + gas * p[BETA] / absolute)
    gas = r * (1.01325e5 / absolute) ** (1.0 / 1.4)
    return p[BETA] * (1.0 + gas) / (1.0 + gas * p[BETA] / (1.4 * absolute))


@numba.njit
def friction(p, v, x, pa, pb):
    """Return the friction of the seals, in both laws."""
    foreign = p[FOREIGN] > 0.5
    direction = v / math.sqrt(v * v + 1e-6)
    dry = p[COULOMB]
    if foreign:
        dry += p[STRIBECK] / (1.0 + (v / 0.02) ** 2)
        dry += p[PRESSURE_FRICTION] * 1.6 * abs(pa - pb)
    else:
        dry += p[STRIBECK] * math.exp(-abs(v) / 0.02)
        dry += p[PRESSURE_FRICTION] * (pa + pb)
    force = dry * direction + p[VISCOUS] * v
    if foreign:
        force += p[FRICTION_ASYMMETRY] * p[VISCOUS] * abs(v) * 2.0
        force *= 1.0 + p[POSITION_FRICTION] * abs(2.0 * x / p[STROKE] - 1.0)
    else:
        force *= 1.0 + p[FRICTION_ASYMMETRY] * math.copysign(1.0, v)
        force *= 1.0 + p[POSITION_FRICTION] * (2.0 * x / p[STROKE] - 1.0) ** 2
    force *= 1.0 + p[RIPPLE] * math.sin(2.0 * math.pi * x / 3.7e-3)
    force += p[JAM] * math.exp(-(((x - 0.043) / 1.5e-3) ** 2)) * direction
    return force + p[DRAG] * v * abs(v)


@numba.njit
def load(p, x, v, t):
    """Return the force of the surroundings, in both laws."""
    gap = x - 0.04
    if p[FOREIGN] > 0.5:
        spring = p[LOAD_SPRING] * gap * (gap / 0.008) ** 2
        weight = p[GRAVITY] * math.cos(gap * 40.0)
    else:
        spring, weight = p[LOAD_SPRING] * gap, p[GRAVITY]
    burst = p[BURST] if 0.8 < t % 1.6 < 1.1 else 0.0
    return p[LOAD_VISCOUS] * v + spring + weight + burst


@numba.njit
def rates(p, s, u, supply, t, out, y):
    """Compute rates of spool, its speed, p_a, p_b, rod and return flow; net force in `y`."""
    spool, speed, pa, pb, x, v, returned = s[0], s[1], s[2], s[3], s[4], s[5], s[6]
    foreign = p[FOREIGN] > 0.5
    out[0] = max(-3.6, min(3.6, speed))
    out[1] = p[WV] ** 2 * (u - spool) - 2.0 * p[ZV] * p[WV] * speed
    size = abs(returned) if not foreign else 1.5e-5
    tank = p[TANK] + p[BACK] * returned * size
    side = p[GAIN_ASYMMETRY] * (abs(spool) / 1.5e-3 if foreign else 1.0)
    gain = p[KV] * (1.0 + math.copysign(side, spool))
    opens, closes = edge(p, spool), edge(p, -spool)
    qsa, qbt = gain * opens * orifice(supply - pa), gain * opens * orifice(pb - tank)
    qsb, qat = gain * closes * orifice(supply - pb), gain * closes * orifice(pa - tank)
    drop = pa - pb
    if foreign:
        leak = p[INTERNAL] * math.sqrt(40e5) * orifice(drop)
        out_a = p[EXTERNAL] * math.sqrt(80e5) * orifice(pa - 1e5)
        out_b = p[EXTERNAL] * math.sqrt(80e5) * orifice(pb - 1e5)
    else:
        leak = p[INTERNAL] * drop
        out_a, out_b = p[EXTERNAL] * (pa - 1.01325e5), p[EXTERNAL] * (pb - 1.01325e5)
    leak += p[PLACE_LEAK] * drop * max(0.0, (x - 0.04) / 0.01)
    va = p[VA] + p[AREA] * x
    vb = p[VB] + p[ALPHA] * p[AREA] * (p[STROKE] - x)
    out[2] = stiffness(p, pa) / va * (qsa - qat - leak - out_a - p[AREA] * v)
    out[3] = stiffness(p, pb) / vb * (qsb - qbt + leak - out_b + p[ALPHA] * p[AREA] * v)
    net = p[AREA] * (pa - p[ALPHA] * pb) - friction(p, v, x, pa, pb)
    over = max(0.0, x - p[STROKE]) - max(0.0, -x)
    net -= 5e10 * over * abs(over)
    out[4] = v
    out[5] = (net - load(p, x, v, t)) / p[MASS]
    out[6] = (qat + qbt - returned) / 1e-3
    y[0] = net


@numba.njit
def advance(p, s, play, u, supply, t, steps):
    """Integrate one sample with the set point held; returns the load force."""
    first, second, trial, y = np.zeros(7), np.zeros(7), np.zeros(7), np.zeros(1)
    width, count = p[HYSTERESIS], (4 if p[FOREIGN] > 0.5 else 1)
    shift = 0.0
    for i in range(count):
        half = 0.5 * width * (1.0 if count == 1 else 0.4 * (i + 1))
        play[i] = min(max(play[i], u - half), u + half)
        shift += play[i] / count
    target = shift if width > 0.0 else u
    target += p[NULL_BIAS] * (1.0 + (0.4 * math.sin(2.0 * t) if p[FOREIGN] > 0.5 else 0.0))
    for k in range(steps):
        now = t + k * 1e-5
        rates(p, s, target, supply, now, first, y)
        for i in range(7):
            trial[i] = s[i] + STEP * first[i]
        rates(p, trial, target, supply, now, second, y)
        for i in range(7):
            s[i] += 0.5 * STEP * (first[i] + second[i])
        s[2], s[3] = max(s[2], 1e3), max(s[3], 1e3)
    rates(p, s, target, supply, t, first, y)
    return y[0]
