"""Forces on the load other than its inertia."""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from hil_emulator.model.constants import GRAVITY
from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.stages import (
    joint_angle,
    joint_carries,
    joint_inertia,
    joint_lever,
    joint_lever_slope,
    joint_mass_moment,
    load,
    load_inertia,
)


@effect(
    load,
    knob=Param("coefficient", "N*s/m", "viscous coefficient B_l of the load", 500.0, 0.0, 1e7,
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
               200.0, -1e8, 1e8),
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
    knob=Param("stiffness", "N/m", "spring between load and ground", 2e4, 0.0, 1e10),
    shape=(
        Param("rest_position", "m", "position without spring force", 0.04, -10.0, 10.0,
              shown="mm", default=0.0, along_stroke=True, spread=factor(1.5)),
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
    knob=Param("stiffness", "N/m", "stiffness of the wall", 1e6, 0.0, 1e10),
    shape=(
        Param("distance", "m", "position at which the load touches it", 0.05, -10.0, 10.0,
              shown="mm", default=0.05, along_stroke=True, spread=factor(1.5)),
        Param("damping", "s/m", "relative growth of the force with the closing speed",
              2.0, 0.0, 50.0, default=2.0, spread=factor(2.0)),
        Param("time_constant", "s", "time constant with which the wall follows its shift",
              0.02, 1e-3, 10.0, shown="ms", default=0.02, spread=factor(2.0)),
    ),
    states=(Quantity("place", "m", "position of the wall over its distance"),),
    source="Hunt and Crossley 1975; a leg that touches ground, or ground that comes up (input "
           "wall_shift)",
    signature="load force rises steeply beyond one position",
    not_modelled="friction along the wall; a wall that moves under the load",
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
    knob=Param("amplitude", "N", "amplitude of the force", 200.0, 0.0, 1e7),
    shape=(
        Param("frequency", "Hz", "frequency", 2.0, 0.0, 100.0, default=2.0, spread=factor(1.5)),
    ),
    states=(Quantity("phase", "1", "phase in radian"),),
    source="external force profile; other profiles enter through the input external_force",
    signature="load force at one frequency, independent of the command",
)
def harmonic_force(phase: float, amplitude: float, frequency: float) -> tuple[float, float]:
    """F = F_0 sin(phi),  dphi/dt = 2 pi f.

    A periodic force shakes the load.
    """
    return amplitude * math.sin(phase), 2.0 * math.pi * frequency


class Triangle(NamedTuple):
    """Joint, cylinder's base and rod's end, see `rotary_joint`."""

    retracted_length: float
    base_distance: float
    crank: float


class Weight(NamedTuple):
    """Mass properties of the joint's load, see `rotary_joint`."""

    mass_moment: float
    elevation: float
    sense: float


@register_jitable
def _lever_squared(position: float, triangle: Triangle) -> tuple[float, float]:
    """Return squared lever arm [m²] and its slope along the rod [m], joint in a triangle.

    With c = c_0 + x and k = (a² + b² - c²)/2 = a b cos(theta): l = a b sin(theta)/c, so
    l² = (a² b² - k²)/c². Limited to at least 10 % of the crank, near the folded triangle.
    """
    a, b = triangle.base_distance, triangle.crank
    c = max(0.1 * b, triangle.retracted_length + position)
    k = 0.5 * (a * a + b * b - c * c)
    squared = (a * a * b * b - k * k) / (c * c)
    if squared < 0.01 * b * b:
        return 0.01 * b * b, 0.0
    return squared, 2.0 * (k - squared) / c


@register_jitable
def _angle(position: float, triangle: Triangle) -> float:
    """Return the angle theta between base and crank [rad]."""
    a, b = triangle.base_distance, triangle.crank
    c = triangle.retracted_length + position
    return math.acos(max(-1.0, min(1.0, (a * a + b * b - c * c) / (2.0 * a * b))))


@register_jitable
def _elevation(position: float, triangle: Triangle, weight: Weight) -> float:
    """Return phi, the angle of the line from joint to centre of mass over the horizontal [rad]."""
    turned = _angle(position, triangle) - _angle(0.0, triangle)
    return weight.elevation + math.copysign(1.0, weight.sense) * turned


@register_jitable
def _lever(position: float, triangle: Triangle, sense: float) -> float:
    """Return dx/dphi [m]."""
    squared, _ = _lever_squared(position, triangle)
    return math.copysign(math.sqrt(squared), sense)


def _lever_slope(position: float, triangle: Triangle, sense: float) -> float:
    """Return d²x/(dphi dx), the change of the lever along the rod."""
    squared, slope = _lever_squared(position, triangle)
    return 0.5 * slope / math.copysign(math.sqrt(squared), sense)


def _mass_moment(mass_moment: float) -> float:
    """m c."""
    return mass_moment


def _inertia(inertia: float) -> float:
    """J."""
    return inertia


def _link_length(link_length: float) -> float:
    """Distance to the next joint."""
    return link_length


def _reflected_mass(position: float, inertia: float, triangle: Triangle) -> float:
    """J / l(x)²."""
    squared, _ = _lever_squared(position, triangle)
    return inertia / squared


@effect(
    load,
    knob=Param("inertia", "kg*m^2", "moment of inertia about the joint", 0.0218, 0.0, 1e6,
               source="public HyQ model: lower leg"),
    shape=(
        Param("retracted_length", "m", "distance of the cylinder's joints at x = 0", 0.282, 0.01,
              10.0, shown="mm", default=0.282, source="places 80 mm in the triangle; assumed",
              spread=factor(1.2)),
        Param("base_distance", "m", "joint to the cylinder's base", 0.322, 0.01, 10.0, shown="mm",
              default=0.322, source="public HyQ bench script", spread=factor(1.2)),
        Param("crank", "m", "joint to the rod's end", 0.045, 0.001, 10.0, shown="mm",
              default=0.045, source="public HyQ bench script", spread=factor(1.2)),
        Param("torque", "N*m", "torque about the joint against extension", 0.0, -1e7, 1e7,
              default=0.0, spread=SETTING),
        Param("mass_moment", "kg*m", "mass times distance of its centre from the joint", 0.1, 0.0,
              1e4, default=0.0, source="0.807 kg (public HyQ model) at 0.125 m (assumed)",
              spread=factor(1.5)),
        Param("elevation", "rad", "angle of that centre over the horizontal at x = 0", 0.0,
              -2.0 * math.pi, 2.0 * math.pi, shown="deg", default=0.0, spread=SETTING),
        Param("sense", "1", "1 if extension increases this angle, -1 if it decreases it", 1.0,
              -1.0, 1.0, default=1.0, spread=SETTING),
        Param("link_length", "m", "distance to the joint of the actuator that this one carries, "
              "which is the next on its supply; 0 without it", 0.35, 0.0, 10.0, shown="mm",
              default=0.0, source="upper leg; assumed", spread=SETTING),
    ),
    source="Lagrange's equation of one joint driven by a cylinder in a triangle",
    signature="reflected mass changes along the stroke: 10.8 kg at a lever of 45 mm; force of "
              "gravity with it",
    not_modelled="more than two joints; a leg that leaves its plane",
    also=(
        (load_inertia, _reflected_mass), (joint_angle, _elevation), (joint_lever, _lever),
        (joint_lever_slope, _lever_slope), (joint_mass_moment, _mass_moment),
        (joint_inertia, _inertia), (joint_carries, _link_length),
    ),
)  # fmt: skip
def rotary_joint(
    position: float, velocity: float, inertia: float, torque: float, triangle: Triangle,
    weight: Weight,
) -> float:  # fmt: skip
    """F = (tau + s m c g cos(phi))/l + M'(x) v²/2,  M = J/l²,  l = a b sin(theta)/c.

    The load turns about a joint.
    """
    squared, slope = _lever_squared(position, triangle)
    mass_slope = -inertia * slope / (squared * squared)
    force = torque / math.sqrt(squared) + 0.5 * mass_slope * velocity * velocity
    if weight.mass_moment != 0.0:
        weighs = weight.mass_moment * GRAVITY * math.cos(_elevation(position, triangle, weight))
        force += weighs / _lever(position, triangle, weight.sense)
    return force


EFFECTS = (
    load_viscous_friction, gravity, load_spring, wall, harmonic_force, rotary_joint,
)  # fmt: skip
