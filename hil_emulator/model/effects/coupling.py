"""Elastic or loose parts between the rod and the load.

With any of them on, rod and load are two bodies and the load cell reads the force between them.
"""

from hil_emulator.model.declare import Param, effect, factor
from hil_emulator.model.stages import coupling, play


@effect(
    coupling,
    knob=Param("compliance", "m/N", "compliance of load cell and frame in series",
               4e-9, 0.0, 1e-5, shown="um/kN",
               source="20 um at 5 kN in a public HyQ bench script; a frame adds 1e-7 and more"),
    source="spring in series with the rod; damping as coupling_damping. A cylinder without mass on "
           "a mount that gives way by C F is the same: its sensor measures the rod against the "
           "cylinder",
    signature="load force rings; rod and load differ in position",
    not_modelled="mass of the cylinder's body on an elastic frame; dry friction of the light rod "
                 "turns over a wider velocity, see actuator.friction_force",
)  # fmt: skip
def coupling_compliance(compliance: float) -> float:
    """F = (x_p - x_l) / C.

    The coupling between rod and load, or the mount of the cylinder, gives way.
    """
    return compliance


def _flanks(gap: float, softness: float) -> float:
    """Compliance of the touching flanks, in series; 0 without a gap."""
    return softness * gap


@effect(
    play,
    knob=Param("gap", "m", "free play of the rod end", 5e-5, 0.0, 0.05, shown="um",
               source="0 to 0.3 mm; assumed"),
    shape=(
        Param("softness", "1/N", "how far a flank yields per force, relative to the gap",
              4e-4, 1e-5, 0.1, shown="1/kN", default=4e-4, spread=factor(3.0)),
    ),
    source="dead zone with elastic flanks (as in Hopsan)",
    signature="load force rests at zero while it changes sign",
    not_modelled="wear; side play",
    also=((coupling, _flanks),),
)  # fmt: skip
def backlash(stretch: float, gap: float) -> float:
    """d = s - max(-g/2, min(g/2, s)).

    There is play between rod and load.
    """
    return stretch - max(-0.5 * gap, min(0.5 * gap, stretch))


EFFECTS = (coupling_compliance, backlash)
