"""Two joints of a leg: a link that rotates about a joint at the end of another link.

Planar double pendulum, driven by the cylinders' forces at their levers. phi is the angle of the
carrying link to the horizontal, psi the angle of the carried link to the carrying link, L the
distance of the joints, and h = L (m c)_2. In addition to two separate links the kinetic energy is

    T = J_2 phi'²/2 + J_2 phi' psi' + h cos(psi) phi' (phi' + psi')

and the potential energy V = (m c)_2 g (sin(phi + psi) - sin(psi)). The resulting terms of
Lagrange's equations are added to the accelerations of separate joints. Inertia J and moment m c of
the carrying link include the mass of the carried link at its joint.
"""

import math
from typing import Any

from hil_emulator.model.constants import GRAVITY
from hil_emulator.model.stages import (
    coupling_acts,
    joint_angle,
    joint_carries,
    joint_inertia,
    joint_lever,
    joint_lever_slope,
    joint_mass_moment,
    load_inertia,
)


def moved_mass(x: Any, dx: Any, par: Any, y: Any) -> float:
    """Return the mass that the actuator of a single joint accelerates at its load [kg]."""
    mass: float = par.load_mass + load_inertia(par, x, dx, y.load_position)
    return mass if coupling_acts(par) else mass + y.rod_mass


def accelerate(dx: Any, par: Any, y: Any, mass: float, change: float) -> None:
    """Set the acceleration of a load [m/s²], and the values that depend on it."""
    y.load_acceleration += change
    y.resisting_force -= mass * change
    if coupling_acts(par):
        dx.stretch_speed -= change
    else:
        dx.velocity += change
        y.acceleration += change
        y.load_force -= y.rod_mass * change


def swing(
    x_1: Any, dx_1: Any, par_1: Any, y_1: Any, x_2: Any, dx_2: Any, par_2: Any, y_2: Any
) -> None:
    """Couple two loads that were accelerated separately: the first one carries the second."""
    l_1 = joint_lever(par_1, x_1, dx_1, y_1.load_position)
    l_2 = joint_lever(par_2, x_2, dx_2, y_2.load_position)
    psi = joint_angle(par_2, x_2, dx_2, y_2.load_position)
    over = math.cos(joint_angle(par_1, x_1, dx_1, y_1.load_position) + psi)
    weighs = joint_mass_moment(par_2, x_2, dx_2) * GRAVITY
    h = joint_carries(par_1, x_1, dx_1) * joint_mass_moment(par_2, x_2, dx_2)
    cosine = h * math.cos(psi)
    sine = h * math.sin(psi)
    inertia = joint_inertia(par_2, x_2, dx_2)
    w_1 = y_1.load_velocity / l_1
    w_2 = y_2.load_velocity / l_2
    # at constant speed of the rod a shorter lever turns the joint faster
    turn_1 = y_1.load_acceleration / l_1
    turn_1 -= w_1 * w_1 * joint_lever_slope(par_1, x_1, dx_1, y_1.load_position)
    turn_2 = y_2.load_acceleration / l_2
    turn_2 -= w_2 * w_2 * joint_lever_slope(par_2, x_2, dx_2, y_2.load_position)
    own_inertia = inertia + 2.0 * cosine
    both = inertia + cosine
    torque_1 = own_inertia * turn_1 + both * turn_2 - sine * w_2 * (2.0 * w_1 + w_2) + weighs * over
    torque_2 = both * turn_1 + sine * w_1 * w_1 + weighs * (over - math.cos(psi))
    m_1 = moved_mass(x_1, dx_1, par_1, y_1)
    m_2 = moved_mass(x_2, dx_2, par_2, y_2)
    m_11 = m_1 + own_inertia / (l_1 * l_1)
    m_12 = both / (l_1 * l_2)
    f_1 = -torque_1 / l_1
    f_2 = -torque_2 / l_2
    determinant = m_11 * m_2 - m_12 * m_12
    accelerate(dx_1, par_1, y_1, m_1, (m_2 * f_1 - m_12 * f_2) / determinant)
    accelerate(dx_2, par_2, y_2, m_2, (m_11 * f_2 - m_12 * f_1) / determinant)


LEG = (moved_mass, accelerate, swing)
"""What `kernel` compiles of this file, in the order of use."""
