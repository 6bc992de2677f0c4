"""Friction of the cylinder's seals (S1 eq. 3.18, S2 eq. 6-7).

Dry friction is declared by its level; the balance turns it against the motion, with sign(v) made
continuous as tanh(v/v_t).
"""

import math

from hil_emulator.model.constants import FASTEST_SLIP
from hil_emulator.model.declare import Param, Quantity, effect
from hil_emulator.model.stages import dry_friction, friction, friction_scale

_STRIBECK_VELOCITY = Param(
    "stribeck_velocity", "m/s", "velocity C_s over which the excess fades", 0.02, 1e-3, 1.0,
    shown="mm/s", default=0.02, source="S1 Fig. 3.8",
)  # fmt: skip


@effect(
    friction,
    knob=Param("coefficient", "N*s/m", "viscous coefficient B", 1000.0, 0.0, 1e5,
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
    knob=Param("force", "N", "Coulomb friction F_c0", 100.0, 0.0, 1e6, source="S1 3.4.2"),
    source="S1 eq. 3.18, sign(v) made continuous as tanh(v/v_t)",
    signature="hydraulic force minus load cell, changing sign with velocity",
    not_modelled="sticking: the rod creeps under forces below F_c0; see presliding",
)
def coulomb_friction(force: float) -> float:
    """F = F_c0 tanh(v/v_t).

    Dry friction opposes the motion.
    """
    return force


@effect(
    dry_friction,
    knob=Param("excess", "N", "breakaway force above Coulomb friction F_s0", 100.0, 0.0, 1e4,
               source="S1 Fig. 3.8"),
    shape=(_STRIBECK_VELOCITY,),
    source="S1 eq. 3.18: F_s0 is the excess over F_c0, so breakaway is their sum; exponent 1 as "
           "printed there, others square it",
    signature="hydraulic force minus load cell below some 50 mm/s",
    not_modelled="friction lag: the curve is the same up and down",
)  # fmt: skip
def stribeck_friction(velocity: float, excess: float, stribeck_velocity: float) -> float:
    """F = F_s0 exp(-|v|/C_s) tanh(v/v_t).

    Friction is higher at low speed.
    """
    return excess * math.exp(-abs(velocity) / stribeck_velocity)


@effect(
    dry_friction,
    knob=Param("area", "m^2", "friction force per sum of chamber pressures", 3e-6, 0.0, 1e-3,
               shown="mm^2"),
    source="F = f (p_a + p_b) as in Simscape; chosen over forms with two areas because the load "
           "cell separates their sum alone",
    signature="hydraulic force minus load cell grows with the sum of the pressures",
    not_modelled="different seals on rod and piston",
)  # fmt: skip
def pressure_friction(pressure_a: float, pressure_b: float, area: float) -> float:
    """F = f (p_a + p_b) tanh(v/v_t).

    The seals' friction grows with pressure.
    """
    return area * (pressure_a + pressure_b)


@effect(
    friction,
    knob=Param("force", "N", "Coulomb friction that bristles carry", 100.0, 0.0, 1e4),
    shape=(
        Param("stiffness", "N/m", "bristle stiffness sigma_0", 2e6, 1e4, 1e8, default=2e6,
              source="1e5 to 1e7 N/m; assumed"),
        Param("excess", "N", "breakaway force above it", 0.0, 0.0, 1e4, default=0.0),
        _STRIBECK_VELOCITY,
    ),
    states=(Quantity("bristle", "m", "mean deflection of the bristles"),),
    source="Canudas de Wit et al. 1995 (LuGre); without the micro-damping sigma_1, whose part "
           "viscous friction takes, so that it is dissipative for every parameter",
    signature="loops of friction over velocity at reversals; the rod sticks and springs back",
    not_modelled="lag of the lubricant film; stands for coulomb_friction, so set that to 0",
)  # fmt: skip
def presliding(
    velocity: float, scale: float, bristle: float, force: float, stiffness: float, excess: float,
    stribeck_velocity: float,
) -> tuple[float, float]:  # fmt: skip
    """F = s_0 z,  dz/dt = v - s_0 |v| z / (F_c + F_s exp(-|v|/C_s)).

    The seals bend before they slide.

    What scales friction scales the level at which bristles slip, not the springs they are. At
    speeds where bristles would slip faster than anything here may, they follow at that rate.
    """
    speed = abs(velocity)
    level = scale * (force + excess * math.exp(-speed / stribeck_velocity))
    slip = stiffness * speed / level
    rate = (velocity - slip * bristle) / max(1.0, slip / FASTEST_SLIP)
    return stiffness * bristle, rate


@effect(
    friction_scale,
    knob=Param("asymmetry", "1", "half the relative difference of both directions", 0.1, -0.5, 0.5,
               shown="%"),
    source="S2: friction differs with direction; S1 Fig. 3.9",
    signature="friction forces of both directions differ by a factor",
)  # fmt: skip
def friction_asymmetry(
    scale: float, velocity: float, asymmetry: float, friction_transition_velocity: float
) -> float:
    """F = F (1 + k tanh(v/v_t)).

    Friction differs between the two directions.
    """
    return scale * (1.0 + asymmetry * math.tanh(velocity / friction_transition_velocity))


@effect(
    friction_scale,
    knob=Param("rise", "1", "relative rise of friction at the ends of the stroke", 0.2, -0.5, 1.0,
               shown="%"),
    source="S2: friction depends on position; a parabola stands for its spline; size assumed",
    signature="friction force against position at constant speed",
    not_modelled="friction that differs between both ends",
)  # fmt: skip
def position_friction(scale: float, position: float, rise: float, cylinder_stroke: float) -> float:
    """F = F (1 + k (2x/L_c - 1)²).

    Friction changes along the stroke.
    """
    from_centre = max(-1.0, min(1.0, 2.0 * position / cylinder_stroke - 1.0))
    return scale * (1.0 + rise * from_centre * from_centre)


EFFECTS = (
    viscous_friction, coulomb_friction, stribeck_friction, pressure_friction, presliding,
    friction_asymmetry, position_friction,
)  # fmt: skip
