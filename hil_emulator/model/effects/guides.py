"""Dry friction of the load's guides: rails, joints, wipers.

Its direction follows bristles, as for the seals (`mechanics.friction_force`): at rest they hold the
load as springs, and a varying force below breakaway does not make it creep.
"""

import math

from numba.extending import register_jitable

from hil_emulator.model.constants import FASTEST_SLIP, SLIDING_BEND
from hil_emulator.model.declare import Param, Quantity, effect, factor
from hil_emulator.model.stages import load

_BEND = Quantity("bend", "1", "bend of the guides' bristles over the presliding distance")


@register_jitable
def _bristles(
    velocity: float, bend: float, level: float, mass: float, transition: float, distance: float
) -> tuple[float, float]:
    """Return the force [N] of bristles and the rate of their bend [1/s] (Dupont et al. 2002).

    Both widths are larger for a light mass or a high speed, to limit the rate at which the
    direction changes.
    """
    width = max(transition, level / (mass * FASTEST_SLIP))
    way = max(distance, max(abs(velocity), width) / FASTEST_SLIP)
    onwards = bend if velocity > 0.0 else -bend
    rate = velocity / way * min(1.0, SLIDING_BEND - onwards)
    return level * math.tanh(bend + velocity / width), rate


@effect(
    load,
    knob=Param("force", "N", "Coulomb friction of the guides", 100.0, 0.0, 1e6,
               source="rails: 0.5 % of the weight and 10 to 50 N of wipers (assumed)"),
    states=(_BEND,),
    source="Coulomb; at rest bristles that do not creep (Dupont et al. 2002)",
    signature="load force minus inertia changes sign with velocity; the load sticks",
    not_modelled="breakaway that grows with the time at rest; friction that grows with side loads",
)  # fmt: skip
def load_coulomb_friction(
    velocity: float, bend: float, force: float, load_mass: float,
    friction_transition_velocity: float, friction_presliding_distance: float,
) -> tuple[float, float]:  # fmt: skip
    """F = F_c D.

    Dry friction of its guides opposes the motion of the load and holds it at rest.
    """
    return _bristles(
        velocity, bend, force, load_mass, friction_transition_velocity, friction_presliding_distance
    )


@effect(
    load,
    knob=Param("excess", "N", "breakaway force of the guides above their Coulomb friction", 50.0,
               0.0, 1e5, source="assumed: half of Coulomb friction"),
    shape=(
        Param("stribeck_velocity", "m/s", "velocity over which the excess fades", 0.02, 1e-3, 1.0,
              shown="mm/s", default=0.02, spread=factor(3.0)),
    ),
    states=(_BEND,),
    source="Stribeck's curve with exponent 1, as S1 eq. 3.18 has it for seals",
    signature="load force minus inertia is larger below some 50 mm/s",
    not_modelled="friction lag: the curve is the same up and down",
)  # fmt: skip
def load_stribeck_friction(
    velocity: float, bend: float, excess: float, stribeck_velocity: float, load_mass: float,
    friction_transition_velocity: float, friction_presliding_distance: float,
) -> tuple[float, float]:  # fmt: skip
    """F = F_s exp(-|v|/v_s) D.

    Friction of its guides is higher where the load moves slowly.
    """
    level = excess * math.exp(-abs(velocity) / stribeck_velocity)
    return _bristles(
        velocity, bend, level, load_mass, friction_transition_velocity, friction_presliding_distance
    )


EFFECTS = (load_coulomb_friction, load_stribeck_friction)
