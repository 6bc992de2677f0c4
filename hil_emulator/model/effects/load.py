"""What pushes against the load beyond its inertia."""

import math

from numba.extending import register_jitable

from hil_emulator.model.declare import Param, Quantity, effect
from hil_emulator.model.stages import load, load_inertia


@effect(
    load,
    knob=Param("coefficient", "N*s/m", "viscous coefficient B_l of the load", 500.0, 0.0, 1e5,
               source="S1 Fig. 3.14: a zero of -10 rad/s at 50 kg"),
    source="S1 eq. 3.39-3.40",
    signature="load force minus inertia, proportional to velocity",
)  # fmt: skip
def load_viscous_friction(velocity: float, coefficient: float) -> float:
    """F = B_l v.

    The load is braked in proportion to its speed.
    """
    return coefficient * velocity


@effect(
    load,
    knob=Param("force", "N", "weight of the load along the rod, against extension",
               200.0, -1e6, 1e6),
    source="robot leg: 0-500 N at the rod; an excavator's boom: 1e5 N",
    signature="constant part of load force minus inertia",
    not_modelled="its change with the joint's angle",
)  # fmt: skip
def gravity(force: float) -> float:
    """F = F_g.

    A constant force acts on the load.
    """
    return force


@effect(
    load,
    knob=Param("stiffness", "N/m", "spring between load and ground", 2e4, 0.0, 1e6),
    shape=(
        Param("rest_position", "m", "position without spring force", 0.04, -1.0, 1.0,
              shown="mm", default=0.0),
    ),
    source="linear spring",
    signature="load force against position",
)  # fmt: skip
def load_spring(position: float, stiffness: float, rest_position: float) -> float:
    """F = k (x - x_0).

    A spring acts on the load.
    """
    return stiffness * (position - rest_position)


@effect(
    load,
    knob=Param("stiffness", "N/m", "stiffness of the wall", 1e6, 0.0, 1e8),
    shape=(
        Param("distance", "m", "position at which the load touches it", 0.05, -1.0, 10.0,
              shown="mm", default=0.05),
        Param("damping", "s/m", "relative growth of the force with the closing speed",
              2.0, 0.0, 50.0, default=2.0),
        Param("time_constant", "s", "time in which the wall follows where it is told to be",
              0.02, 1e-3, 10.0, shown="ms", default=0.02),
    ),
    states=(Quantity("place", "m", "position of the wall over its distance"),),
    source="Hunt and Crossley 1975; a leg that touches ground, or ground that comes up (input "
           "wall_shift)",
    signature="load force rises steeply beyond one position",
    not_modelled="friction along the wall; a wall that gives way to the load",
)  # fmt: skip
def wall(
    position: float, velocity: float, wall_shift: float, place: float, stiffness: float,
    distance: float, damping: float, time_constant: float,
) -> tuple[float, float]:  # fmt: skip
    """F = k d (1 + c d'), d = x - (x_w + s) in the wall, never pulling;  ds/dt = (s_set - s)/tau.

    The load meets an obstacle.
    """
    speed = (wall_shift - place) / time_constant
    depth = position - distance - place
    if depth <= 0.0:
        return 0.0, speed
    return max(0.0, stiffness * depth * (1.0 + damping * (velocity - speed))), speed


@effect(
    load,
    knob=Param("amplitude", "N", "amplitude of the force", 200.0, 0.0, 1e5),
    shape=(Param("frequency", "Hz", "frequency", 2.0, 0.0, 100.0, default=2.0),),
    states=(Quantity("phase", "1", "phase in radian"),),
    source="external force profile; other profiles enter through the input external_force",
    signature="load force at one frequency, whatever the command",
)
def harmonic_force(phase: float, amplitude: float, frequency: float) -> tuple[float, float]:
    """F = F_0 sin(phi),  dphi/dt = 2 pi f.

    A periodic force shakes the load.
    """
    return amplitude * math.sin(phase), 2.0 * math.pi * frequency


@register_jitable
def _lever_squared(
    position: float, retracted_length: float, base_distance: float, crank: float
) -> tuple[float, float]:
    """Return squared lever arm [m²] and its slope along the rod [m], joint in a triangle.

    With c = c_0 + x and k = (a² + b² - c²)/2 = a b cos(theta): l = a b sin(theta)/c, so
    l² = (a² b² - k²)/c². Kept above a tenth of the crank, where the triangle would fold.
    """
    c = max(0.1 * crank, retracted_length + position)
    k = 0.5 * (base_distance * base_distance + crank * crank - c * c)
    squared = (base_distance * base_distance * crank * crank - k * k) / (c * c)
    if squared < 0.01 * crank * crank:
        return 0.01 * crank * crank, 0.0
    return squared, 2.0 * (k - squared) / c


def _reflected_mass(
    position: float, inertia: float, retracted_length: float, base_distance: float, crank: float
) -> float:
    """J / l(x)²."""
    squared, _ = _lever_squared(position, retracted_length, base_distance, crank)
    return inertia / squared


@effect(
    load,
    knob=Param("inertia", "kg*m^2", "moment of inertia about the joint", 0.0218, 0.0, 10.0,
               source="public HyQ model: lower leg"),
    shape=(
        Param("retracted_length", "m", "distance of the cylinder's joints at x = 0", 0.282, 0.01,
              10.0, shown="mm", default=0.282, source="places 80 mm in the triangle; assumed"),
        Param("base_distance", "m", "joint to the cylinder's base", 0.322, 0.01, 10.0, shown="mm",
              default=0.322, source="public HyQ bench script"),
        Param("crank", "m", "joint to the rod's end", 0.045, 0.001, 10.0, shown="mm",
              default=0.045, source="public HyQ bench script"),
        Param("torque", "N*m", "torque about the joint against extension", 0.0, -1e3, 1e3,
              default=0.0),
    ),
    source="Lagrange's equation of one joint driven by a cylinder in a triangle",
    signature="reflected mass changes along the stroke: 10.8 kg at a lever of 45 mm",
    not_modelled="further joints of the leg; a torque that turns with gravity",
    also=((load_inertia, _reflected_mass),),
)  # fmt: skip
def rotary_joint(
    position: float, velocity: float, inertia: float, retracted_length: float,
    base_distance: float, crank: float, torque: float,
) -> float:  # fmt: skip
    """F = tau/l + M'(x) v²/2,  M = J/l²,  l = a b sin(theta)/c.

    The load turns about a joint.
    """
    squared, slope = _lever_squared(position, retracted_length, base_distance, crank)
    mass_slope = -inertia * slope / (squared * squared)
    return torque / math.sqrt(squared) + 0.5 * mass_slope * velocity * velocity


EFFECTS = (
    load_viscous_friction, gravity, load_spring, wall, harmonic_force, rotary_joint,
)  # fmt: skip
