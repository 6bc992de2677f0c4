"""Rest of an actuator under its load; these functions are also translated to C."""

import math

STRETCHING = ("coupling_compliance_compliance", "backlash_gap", "backlash_softness")
"""Parameters of `stretch_under`, as fields of the record; a missing field is zero."""


def bearing_pressures(
    force: float, low: float, high: float, alpha: float, area: float
) -> tuple[float, float]:
    """Return the pressures a and b [Pa] that hold a force, as an unloaded valve would.

    Args:
        force: of the load on the rod [N].
        low: pressure of the tank [Pa].
        high: pressure of the supply [Pa].
        alpha: annulus area over piston area.
        area: of the piston [m^2].

    Returns:
        Both NaN without a force or an area, or if no pressures between tank and supply hold it.

    """
    if force == 0.0 or area == 0.0:
        return math.nan, math.nan
    wanted = force / area
    pressure_b = min(high, max(low, (high - wanted) / (1.0 + alpha)))
    pressure_a = wanted + alpha * pressure_b
    if not low <= pressure_a <= high:
        return math.nan, math.nan
    return pressure_a, pressure_b


def stretch_under(force: float, compliance: float, gap: float, softness: float) -> float:
    """Return the stretch between rod and load under a force [m].

    Args:
        force: force of the load on the rod [N].
        compliance: of the coupling [m/N].
        gap: of the backlash [m].
        softness: of the gap's ends, in gaps [1/N].

    """
    return force * compliance + (math.copysign(0.5 * gap, force) + force * gap * softness)


def without_gas(pressure: float, gas_pressure: float) -> float:
    """Return the state [Pa] of a chamber at a pressure, the inverse of `chamber_pressure`."""
    return pressure - (gas_pressure * gas_pressure / pressure if gas_pressure != 0.0 else 0.0)
