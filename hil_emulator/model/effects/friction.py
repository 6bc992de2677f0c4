"""Friction of the cylinder's seals (S1 eq. 3.18, S2 eq. 6-7)."""

import math

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import friction

_TRANSITION = Param(
    "transition_velocity", "m/s", "width over which the force changes sign",
    1e-3, 1e-5, 0.1, shown="mm/s", default=1e-3,
)  # fmt: skip


@effect(
    friction,
    knob=Param("coefficient", "N*s/m", "viscous coefficient B", 1000.0, 0.0, 1e5,
               source="S1 3.4.2"),
    source="S1 eq. 3.18",
    signature="hydraulic force minus load cell, proportional to velocity",
)  # fmt: skip
def viscous_friction(velocity: float, coefficient: float) -> float:
    """F = B v."""
    return coefficient * velocity


@effect(
    friction,
    knob=Param("force", "N", "Coulomb friction F_c0", 100.0, 0.0, 1e4, source="S1 3.4.2"),
    shape=(_TRANSITION,),
    source="S1 eq. 3.18, sign(v) made continuous as tanh(v/v_t)",
    signature="hydraulic force minus load cell jumps where the velocity changes sign",
    not_modelled="sticking: below v_t the rod creeps",
)
def coulomb_friction(velocity: float, force: float, transition_velocity: float) -> float:
    """F = F_c0 tanh(v/v_t)."""
    return force * math.tanh(velocity / transition_velocity)


@effect(
    friction,
    knob=Param("excess", "N", "breakaway force above Coulomb friction F_s0", 100.0, 0.0, 1e4,
               source="S1 Fig. 3.8"),
    shape=(
        Param("stribeck_velocity", "m/s", "velocity C_s over which it fades", 0.02, 1e-3, 1.0,
              shown="mm/s", default=0.02, source="S1 Fig. 3.8"),
        _TRANSITION,
    ),
    source="S1 eq. 3.18: F_s0 is the excess over F_c0, so breakaway is their sum",
    signature="hydraulic force minus load cell below some 50 mm/s",
    not_modelled="friction lag: the curve is the same up and down",
)  # fmt: skip
def stribeck_friction(
    velocity: float, excess: float, stribeck_velocity: float, transition_velocity: float
) -> float:
    """F = F_s0 exp(-|v|/C_s) tanh(v/v_t)."""
    fading = math.exp(-abs(velocity) / stribeck_velocity)
    return excess * fading * math.tanh(velocity / transition_velocity)


EFFECTS = (viscous_friction, coulomb_friction, stribeck_friction)
