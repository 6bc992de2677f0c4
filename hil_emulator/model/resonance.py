"""Natural frequency of a mass on the oil of its cylinder."""

import math
from collections.abc import Mapping

FIELDS = (
    "cylinder_piston_area", "cylinder_area_ratio", "cylinder_stroke", "cylinder_dead_volume_a",
    "cylinder_dead_volume_b", "oil_bulk_modulus", "load_mass",
)  # fmt: skip
"""Parameters of the natural frequency."""


def on_oil(values: Mapping[str, float]) -> float:
    """Return the natural frequency of the mass on its oil at mid-stroke [Hz].

    f = √(β A² (1/V_a + α²/V_b)/m)/2π (Merritt 1967, 6-2), with free air and hoses left out.

    Args:
        values: `FIELDS`, SI.

    """
    area, half = values["cylinder_piston_area"], 0.5 * values["cylinder_stroke"]
    stiffness = 0.0
    for side, a in (("a", area), ("b", area * values["cylinder_area_ratio"])):
        volume = values[f"cylinder_dead_volume_{side}"] + a * half
        stiffness += values["oil_bulk_modulus"] * a**2 / volume
    return math.sqrt(stiffness / values["load_mass"]) / (2.0 * math.pi)
