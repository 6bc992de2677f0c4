"""What a configuration need not say, because it follows from what it says."""

import math
from collections.abc import Mapping


def spool_travel(rated_current: float | None, values: Mapping[str, float]) -> float:
    """Return where the spool has its stop [A]: where the valve is fully open; inf if nothing says.

    Args:
        rated_current: current of full opening [A], where a data sheet's is given.
        values: parameters by field name, SI.

    """
    return rated_current or values.get("current_saturation_limit", math.inf)


def derived(rated_current: float | None, values: Mapping[str, float]) -> dict[str, float]:
    """Return parameters by field name, SI, for those that the configuration leaves unsaid."""
    return {"spool_stops_limit": spool_travel(rated_current, values)}
