"""Friction of the cylinder's seals (S1 eq. 3.18, S2 eq. 6-7).

Dry friction is declared by its level; the balance directs it against the motion, or at rest against
the driving force. D is its direction, -1 to 1; it is that of the velocity once the seals slide
(`mechanics.friction_force`).
"""

import math
from typing import NamedTuple

from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.stages import (
    dry_friction,
    friction,
    friction_direction,
    friction_scale,
)

_STRIBECK_VELOCITY = Param(
    "stribeck_velocity", "m/s", "velocity C_s over which the excess fades", 0.02, 1e-3, 1.0,
    shown="mm/s", default=0.02, source="S1 Fig. 3.8", spread=factor(3.0),
)  # fmt: skip


@effect(
    friction,
    knob=Param("coefficient", "N*s/m", "viscous coefficient B", 1000.0, 0.0, 1e7,
               source="S1 3.4.2"),
    source="S1 eq. 3.18",
    signature="hydraulic force minus load cell, proportional to velocity",
)  # fmt: skip
def viscous_friction(velocity: float, viscosity: float, scale: float, coefficient: float) -> float:
    """F = B v nu/nu_40.

    Friction grows with speed.
    """
    return scale * coefficient * velocity * viscosity


@effect(
    dry_friction,
    knob=Param("force", "N", "Coulomb friction F_c0", 100.0, 0.0, 1e8, source="S1 3.4.2"),
    source="S1 eq. 3.18; at rest bristles that do not creep (Dupont et al. 2002)",
    signature="hydraulic force minus load cell, changing sign with velocity; the rod sticks",
    not_modelled="breakaway that grows with the time at rest",
)
def coulomb_friction(force: float) -> float:
    """F = F_c0 D.

    Dry friction opposes the motion and holds a rod at rest.
    """
    return force


@effect(
    dry_friction,
    knob=Param("excess", "N", "breakaway force above Coulomb friction F_s0", 100.0, 0.0, 1e8,
               source="S1 Fig. 3.8"),
    shape=(_STRIBECK_VELOCITY,),
    source="S1 eq. 3.18: F_s0 is the excess over F_c0, so breakaway is their sum; exponent 1 as "
           "printed there, others square it",
    signature="hydraulic force minus load cell below some 50 mm/s",
    not_modelled="friction lag: the curve is the same up and down; see film_lag",
)  # fmt: skip
def stribeck_friction(velocity: float, excess: float, stribeck_velocity: float) -> float:
    """F = F_s0 exp(-|v|/C_s) D.

    Friction is higher at low speed.
    """
    return excess * math.exp(-abs(velocity) / stribeck_velocity)


@effect(
    dry_friction,
    knob=Param("area", "m^2", "friction force per sum of chamber pressures", 3e-6, 0.0, 0.1,
               shown="mm^2"),
    source="F = f (p_a + p_b) as in Simscape; chosen over forms with two areas because the load "
           "cell shows only their sum",
    signature="hydraulic force minus load cell grows with the sum of the pressures",
    not_modelled="different seals on rod and piston",
)  # fmt: skip
def pressure_friction(pressure_a: float, pressure_b: float, area: float) -> float:
    """F = f (p_a + p_b) D.

    The seals' friction grows with pressure.
    """
    return area * (pressure_a + pressure_b)


@effect(
    friction_scale,
    knob=Param("asymmetry", "1", "half the relative difference of both directions", 0.1, -0.5, 0.5,
               shown="%"),
    source="S2: friction differs with direction; S1 Fig. 3.9",
    signature="friction forces of both directions differ by a factor",
)  # fmt: skip
def friction_asymmetry(scale: float, direction: float, asymmetry: float) -> float:
    """F = F (1 + k D).

    Friction differs between the two directions.
    """
    return scale * (1.0 + asymmetry * direction)


@effect(
    friction_scale,
    knob=Param("rise", "1", "relative rise of friction at the ends of the stroke", 0.2, -0.5, 1.0,
               shown="%"),
    source="S2: friction depends on position; a parabola stands for its spline; size assumed",
    signature="friction force against position at constant speed",
    not_modelled="friction that differs between both ends: see friction_along_stroke",
)  # fmt: skip
def position_friction(scale: float, position: float, rise: float, cylinder_stroke: float) -> float:
    """F = F (1 + k (2x/L_c - 1)²).

    Friction changes along the stroke.
    """
    from_centre = max(-1.0, min(1.0, 2.0 * position / cylinder_stroke - 1.0))
    return scale * (1.0 + rise * from_centre * from_centre)


class StrokeTable(NamedTuple):
    """Relative course of friction at five points of the stroke, see `friction_along_stroke`."""

    at_0: float
    at_25: float
    at_50: float
    at_75: float
    at_100: float


def _share(name: str, typical: float) -> Param:
    return Param(
        name, "1", f"course at {name[3:]} % of the stroke, in parts of the strength", typical, -1.0,
        1.0, default=typical, spread=SETTING,
    )  # fmt: skip


@effect(
    friction_scale,
    knob=Param("strength", "1", "relative change of friction where the course is 1", 0.2, -0.9, 0.9,
               shown="%"),
    shape=(
        _share("at_0", -1.0), _share("at_25", -0.5), _share("at_50", 0.0), _share("at_75", 0.5),
        _share("at_100", 1.0),
    ),
    source="S2 Fig. 2b: a spline over the stroke, here straight between five points; unstated it "
           "rises from one end to the other",
    signature="friction force against position at constant speed, different at both ends",
)  # fmt: skip
def friction_along_stroke(
    scale: float, position: float, strength: float, course: StrokeTable, cylinder_stroke: float
) -> float:
    """F = F (1 + k s(x)),  s straight between points at 0, 25, 50, 75 and 100 % of the stroke.

    Friction follows a table along the stroke, such as a bore that narrows towards one end.
    """
    z = max(0.0, min(4.0, 4.0 * position / cylinder_stroke))
    share = course.at_0 * max(0.0, 1.0 - z) + course.at_25 * max(0.0, 1.0 - abs(z - 1.0))
    share += course.at_50 * max(0.0, 1.0 - abs(z - 2.0))
    share += course.at_75 * max(0.0, 1.0 - abs(z - 3.0)) + course.at_100 * max(0.0, z - 3.0)
    return scale * (1.0 + strength * share)


@effect(
    friction_scale,
    knob=Param("strength", "1", "largest relative change of friction", 0.2, 0.0, 0.9, shown="%"),
    shape=(
        Param("time_constant", "s", "time in which the film follows the speed", 0.05, 1e-3, 1.0,
              shown="ms", default=0.05, source="10 to 100 ms assumed", spread=factor(3.0)),
        Param("asymmetry", "1", "part by which the loop is wider while the rod extends, and "
              "narrower while it retracts; with 100 % it has a loop in one direction only",
              0.0, -1.0, 1.0, shown="%", default=0.0,
              source="S1 Fig. 3.9: the loop is wider for v > 0", spread=SETTING),
    ),
    states=(Quantity("speed", "m/s", "speed that the film's thickness belongs to"),),
    source="S1 Fig. 3.9; first-order lag of the film's thickness from Tran, Hafizah and Yanada "
           "2012; the factor is assumed, bounded so that friction never drives",
    signature="loops of friction over velocity, also in full sliding; widest where the velocity "
              "has about the frequency 1/(4 pi tau), 1.6 Hz at 50 ms, and narrow far from it",
    not_modelled="different lags of a growing and of a shrinking film, and at rest",
)  # fmt: skip
def film_lag(
    scale: float, velocity: float, speed: float, strength: float, time_constant: float,
    asymmetry: float, friction_transition_velocity: float,
) -> tuple[float, float]:  # fmt: skip
    """F = F (1 + k_v (|v| - v_f)/(|v| + v_f + v_t)),  dv_f/dt = (|v| - v_f)/tau.

    Friction is higher while the rod speeds up than while it slows down.

    The film is still thin then, and still thick afterwards; at steady speed the effect is 0.
    k_v = k (1 + a v/(|v| + v_t))/(1 + |a|): the wider loop has the whole strength.
    """
    ahead, width = abs(velocity) - speed, abs(velocity) + friction_transition_velocity
    wider = strength * (1.0 + asymmetry * velocity / width) / (1.0 + abs(asymmetry))
    factor = 1.0 + wider * ahead / (abs(velocity) + speed + friction_transition_velocity)
    return scale * factor, ahead / time_constant


@effect(
    friction_direction,
    knob=Param("share", "1", "share of Dahl's law in the direction of dry friction", 1.0, 0.0, 1.0),
    states=(Quantity("bend", "1", "bend of the seals over that of sliding ones, -1 to 1"),),
    source="Dahl 1968, exponent 1",
    signature="after a reversal friction follows an exponential of the distance, without a "
              "transition over velocity",
    not_modelled="other exponents of Dahl's law",
)  # fmt: skip
def dahl_friction(
    direction: float, velocity: float, way: float, bend: float, share: float
) -> tuple[float, float]:
    """D = D + k (z - D),  dz/dt = (v - |v| z)/d,  d the presliding distance.

    The seals yield from the beginning of their bend.
    """
    per_way = 1.0 / way
    return direction + share * (bend - direction), (velocity - abs(velocity) * bend) * per_way


EFFECTS = (
    viscous_friction, coulomb_friction, stribeck_friction, pressure_friction, friction_asymmetry,
    position_friction, friction_along_stroke, film_lag, dahl_friction,
)  # fmt: skip
