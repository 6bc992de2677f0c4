"""What pushes against the load beyond its inertia."""

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import load


@effect(
    load,
    knob=Param("coefficient", "N*s/m", "viscous coefficient B_l of the load", 500.0, 0.0, 1e5,
               source="S1 Fig. 3.14: a zero of -10 rad/s at 50 kg"),
    source="S1 eq. 3.39-3.40",
    signature="load force minus inertia, proportional to velocity",
)  # fmt: skip
def load_viscous_friction(velocity: float, coefficient: float) -> float:
    """F = B_l v."""
    return coefficient * velocity


@effect(
    load,
    knob=Param("force", "N", "weight of the load along the rod, against extension",
               200.0, -5000.0, 5000.0),
    source="robot leg: 0-500 N at the rod",
    signature="constant part of load force minus inertia",
    not_modelled="its change with the joint's angle",
)  # fmt: skip
def gravity(force: float) -> float:
    """F = F_g."""
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
    """F = k (x - x_0)."""
    return stiffness * (position - rest_position)


EFFECTS = (load_viscous_friction, gravity, load_spring)
