"""Velocity gain and largest current of a configured valve and cylinder."""

import math
from collections.abc import Mapping

RATED_SPEED = 1.0
"""Speed limit of a rod [m/s] (assumed: usual limit of seals)."""


def velocity_gain(plant: Mapping[str, float]) -> float:
    """Return the no-load speed over the valve current [m/(s A)], extending.

    From continuity at both edges: v = K_v/A_p √((p_s - α p_t)/(1 + α³)) (from S1 eq. 3.9, 3.10 with
    A_p p_a = α A_p p_b).
    """
    alpha = plant["cylinder_area_ratio"]
    drop = max(plant["supply_pressure"] - alpha * plant.get("tank_pressure", 0.0), 1e5)
    area = plant["cylinder_piston_area"]
    return plant["valve_gain"] / area * math.sqrt(drop / (1.0 + alpha**3))


def largest_current(plant: Mapping[str, float]) -> float:
    """Return the largest valve current [A], limited by the driver or by the speed of the seals."""
    saturation = plant.get("current_saturation_limit", math.inf)
    return min(saturation, RATED_SPEED / velocity_gain(plant))
