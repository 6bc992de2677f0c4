"""Values that a configuration need not state, because they follow from others."""

import math
from collections.abc import Mapping

from hil_emulator.model.constants import LIGHTEST_ROD

STEEL = 210e9
"""Young's modulus of steel [Pa]."""

LOADED_STEEL = 0.2
"""Cross-section of the steel that an end stop strains over the piston's area (assumed): a tube of
16 mm bore with 1.5 mm wall has 0.41, and rod, piston and heads yield as much again."""

STOP_REACH = 0.5
"""Largest angle by which a mass may swing on an end stop in one step [rad] (assumed): the impact
is exact to 0.1 % of range then."""


def spool_travel(rated_current: float | None, values: Mapping[str, float]) -> float:
    """Return the stop of the spool [A]: where the valve is fully open; inf if it is unknown.

    Args:
        rated_current: current of full opening on a data sheet [A], if there is one.
        values: parameters by field name, SI.

    """
    return rated_current or values.get("current_saturation_limit", math.inf)


def stop_stiffness(values: Mapping[str, float], step: float) -> float:
    """Return the stiffness of a cylinder's ends [N/m]: k = E A/L of the steel around its stroke.

    The ends are softer for a light mass that would swing faster than the step can follow.

    Args:
        values: parameters by field name, SI.
        step: integration step [s].

    """
    steel = LOADED_STEEL * values["cylinder_piston_area"]
    rod = values.get("rod_mass_mass", 0.0)
    loose = values.get("coupling_compliance_compliance", 0.0) or values.get("backlash_gap", 0.0)
    mass = max(rod, LIGHTEST_ROD) if loose else values["load_mass"] + rod
    return min(STEEL * steel / values["cylinder_stroke"], mass * (STOP_REACH / step) ** 2)


def derived(
    rated_current: float | None, values: Mapping[str, float], step: float
) -> dict[str, float]:
    """Return the parameters of a whole actuator that are not stated, by field name, SI.

    Args:
        rated_current: current of full opening on a data sheet [A], if there is one.
        values: the stated ones.
        step: integration step [s].

    """
    return {
        "spool_stops_limit": spool_travel(rated_current, values),
        "end_stops_stiffness": stop_stiffness(values, step),
    }
