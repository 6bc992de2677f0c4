"""Published forms of the base laws that differ from the model's.

The model states each base law in one form. Another maker's valve, oil or seal may follow another
published form of the same law. An effect of the catalogue leads from the model's form to the other
one. Identification fits its size as a parameter, within the usual size that is given here.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class UsualEffect:
    """An effect that every machine has to some extent, but no data sheet states.

    Attributes:
        law: name of the base law that it refines.
        name: name of the effect.
        size: standard deviation of its knob, from the machine's parameters.
        source: source of the size.
        least: size below which nothing distinguishes it from other parameters, in standard
            deviations.

    """

    law: str
    name: str
    size: Callable[[Mapping[str, float]], float]
    source: str
    least: float = 0.0


THIRD_ORDER = 0.3
"""Additional time constant of the spool over that of its second order (assumed)."""

SHORTEST_LAG = 0.2
"""Part of the usual lag below which zero is fitted. Like a change of the spool's frequency and
damping it delays, up to 0.5 % of the amplitude at 0.4 of the natural frequency; it would need steps
as short as itself."""


def _further_lag(plant: Mapping[str, float]) -> float:
    return THIRD_ORDER / (2.0 * math.pi * plant["valve_natural_frequency"])


USUAL = (
    UsualEffect("flow through an edge from laminar to turbulent", "series_resistance",
                lambda _: 0.7, "turbulent at any opening, by a critical Reynolds number (Merritt "
                "1967, 3.2), or with both drops in series (Borutzky et al. 2002)"),
    UsualEffect("dry friction at rest and in reversal", "dahl_friction", lambda _: 0.7,
                "tanh, Dahl, LuGre, Karnopp (Armstrong-Helouvry, Dupont and Canudas de Wit 1994)"),
    UsualEffect("stiffness of the oil", "modulus_pressure", lambda _: 25.0,
                "5 to 12 of oil alone, 50 with hoses between 20 and 160 bar (Hoffmann 1981, in "
                "Gholizadeh et al. 2011)"),
    UsualEffect("stiffness of the oil", "entrained_air", lambda _: 0.003, "assumed: 0.1 to 1 %"),
    UsualEffect("dynamics of the spool", "driver_lag", _further_lag, "coil and driver",
                SHORTEST_LAG),
)  # fmt: skip
"""Effects that every machine has to a small extent."""
