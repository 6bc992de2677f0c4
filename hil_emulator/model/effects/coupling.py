"""What lies between the rod and the load: elastic or loose parts.

With any of them on, rod and load are two bodies and the load cell reads the force between them.
"""

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import coupling, play


@effect(
    coupling,
    knob=Param("compliance", "m/N", "compliance of load cell and frame in series",
               4e-9, 0.0, 1e-5, shown="um/kN",
               source="20 um at 5 kN in a public HyQ bench script; a frame adds 1e-7 and more"),
    source="spring in series with the rod; damping as coupling_damping",
    signature="load force rings; rod and load differ in position",
    not_modelled="mass of the cylinder's body on an elastic frame",
)  # fmt: skip
def coupling_compliance(compliance: float) -> float:
    """F = (x_p - x_l) / C."""
    return compliance


def _contact(contact_compliance: float) -> float:
    """Compliance of the touching flanks, in series."""
    return contact_compliance


@effect(
    play,
    knob=Param("gap", "m", "free play of the rod end", 5e-5, 0.0, 1e-3, shown="um",
               source="0 to 0.3 mm; assumed"),
    shape=(
        Param("contact_compliance", "m/N", "compliance of the contact", 2e-8, 1e-9, 1e-5,
              shown="um/kN", default=2e-8),
    ),
    source="dead zone with elastic flanks (as in Hopsan)",
    signature="load force rests at zero while it changes sign",
    not_modelled="wear; side play",
    also=((coupling, _contact),),
)  # fmt: skip
def backlash(stretch: float, gap: float) -> float:
    """d = s - max(-g/2, min(g/2, s))."""
    return stretch - max(-0.5 * gap, min(0.5 * gap, stretch))


EFFECTS = (coupling_compliance, backlash)
