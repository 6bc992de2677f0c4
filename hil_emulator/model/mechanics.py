"""Newton's law for the rod and the load (S1 eq. 3.15-3.19).

Signs and the arguments of every function as in `actuator`.
"""

import math
from typing import Any

from hil_emulator.model.constants import FASTEST_SLIP, LIGHTEST_ROD, SLIDING_BEND
from hil_emulator.model.stages import (
    coupling,
    coupling_acts,
    dry_friction,
    dry_friction_acts,
    friction,
    friction_direction,
    friction_scale,
    inertia,
    load,
    load_inertia,
    play,
    stop,
)


def lambert(x: float) -> tuple[float, float]:
    """Return numerator and denominator of tanh: nine terms of Lambert's continued fraction.

    Up to |x| = 1.25 they are exact to 1e-15, to 1 to the last digit.
    """
    s = x * x
    lower = 34459425.0 + s * (16216200.0 + s * (945945.0 + s * (13860.0 + s * 45.0)))
    upper = 34459425.0 + s * (4729725.0 + s * (135135.0 + s * (990.0 + s)))
    return x * upper, lower


def direction_of(bend: float) -> float:
    """Return tanh without a library call, which would take as long as the rest of a balance.

    Above 1 it is computed from exp(-2 x), the sixteenth power of exp(-x/8); above 20 it is 1 to the
    last digit.
    """
    size = abs(bend)
    if size < 1.0:
        upper, lower = lambert(bend)
        return upper / lower
    if size > 20.0:
        return math.copysign(1.0, bend)
    upper, lower = lambert(size / 16.0)
    fading = (lower - upper) / (lower + upper)
    fading *= fading
    fading *= fading
    fading *= fading
    fading *= fading
    return math.copysign((1.0 - fading) / (1.0 + fading), bend)


def friction_force(x: Any, dx: Any, par: Any, held: Any, y: Any, per_mass: float) -> float:
    """Friction of the seals on the mass that moves with them (S1 eq. 3.18) [N].

    sign(v) is the direction tanh(z + v/v_t): a rod at rest is held by the bend z of its seals. The
    seals are elastic, dz/dt = v/d, up to SLIDING_BEND - 1, and yield from there to SLIDING_BEND.
    Without the elastic part a varying load below breakaway would make the rod creep (Dupont et al.
    2002). Both widths are larger for a light mass or a high speed, to limit the rate at which the
    direction changes.
    """
    v = x.velocity
    level = dry_friction(par, x, dx, v, x.position, y.pressure_a, y.pressure_b)
    width = max(par.friction_transition_velocity, level * (per_mass / FASTEST_SLIP))
    way = max(par.friction_presliding_distance, max(abs(v), width) / FASTEST_SLIP)
    direction = direction_of(x.seal_bend + v * (1.0 / width))
    direction = friction_direction(par, x, dx, direction, v, way)
    scale = friction_scale(par, x, dx, 1.0, direction, v, x.position)
    if dry_friction_acts(par):
        onwards = x.seal_bend if v > 0.0 else -x.seal_bend
        dx.seal_bend = v / way * min(1.0, SLIDING_BEND - onwards)
    smooth = friction(par, x, dx, v, x.position, held.viscosity, scale)
    force: float = smooth + scale * level * direction
    return force


def move_rod(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Sum the forces on rod and load (S1 eq. 3.15-3.19) into accelerations."""
    position = x.position
    velocity = x.velocity
    area = par.cylinder_piston_area
    f_h = area * (y.pressure_a - par.cylinder_area_ratio * y.pressure_b)
    f_stop = stop(par, x, dx, position, velocity)
    x_l = position - x.stretch
    v_l = velocity - x.stretch_speed
    f_load = load(par, x, dx, x_l, v_l, held.wall_shift) + held.external_force
    m_l = par.load_mass + load_inertia(par, x, dx, x_l)
    m_rod = inertia(par, x, dx, position)
    m_free = max(m_rod, LIGHTEST_ROD) if coupling_acts(par) else m_l + m_rod
    per_mass = 1.0 / m_free
    f_f = friction_force(x, dx, par, held, y, per_mass)
    net = f_h - f_f + f_stop
    if coupling_acts(par):
        f = coupling_force(x, dx, par)
        a_l = (f - f_load) / m_l
        acceleration = (net - f) * per_mass
        dx.stretch = x.stretch_speed
        dx.stretch_speed = acceleration - a_l
    else:
        acceleration = (net - f_load) * per_mass
        a_l = acceleration
        f = net - m_rod * acceleration
    dx.position = velocity
    dx.velocity = acceleration
    y.position = position
    y.velocity = velocity
    y.acceleration = acceleration
    y.hydraulic_force = f_h
    y.friction_force = f_f
    y.stop_force = f_stop
    y.rod_mass = m_rod
    y.load_force = f
    y.resisting_force = f_load
    y.load_position = x_l
    y.load_velocity = v_l
    y.load_acceleration = a_l


def coupling_force(x: Any, dx: Any, par: Any) -> float:
    """F = k d (1 + c d' sign(d)), never beyond zero: elastic, damped, continuous at contact [N]."""
    stretch = play(par, x, dx, x.stretch)
    growth = 1.0 + par.load_coupling_damping * math.copysign(1.0, stretch) * x.stretch_speed
    force: float = stretch / coupling(par, x, dx) * max(0.0, growth)
    return force


MECHANICS = (coupling_force, lambert, direction_of, friction_force, move_rod)
"""What `kernel` compiles of this file, in the order of use."""
