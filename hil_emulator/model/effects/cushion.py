"""Oil that a plunger traps at the ends of the stroke and that brakes the rod.

chamber --- main port            until the plunger enters the bore of the cylinder's end
chamber --- annular gap --- main port            from there on
            check valve (only towards the chamber)
"""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from hil_emulator.model.constants import DISCHARGE
from hil_emulator.model.declare import Param, Quantity, effect, factor
from hil_emulator.model.effects.supply import Oil
from hil_emulator.model.stages import (
    cushion_a,
    cushion_b,
    cushion_flow_a,
    cushion_flow_b,
    cushion_rates,
    port_area,
    stop,
)

LEAST_WIDTH = 1e5
"""Smallest pressure drop in `gap_flow` up to which the flow in a short gap is laminar [Pa]
(assumed: a turbulent orifice has an infinite rate at zero drop)."""

RELEASE = 1e-4
"""Decay time of a remaining pressure once the plunger has left its bore [s] (assumed)."""


class Plunger(NamedTuple):
    """Sizes of a plunger and its bore, see `cushion_plunger`."""

    length: float
    share: float
    diameter: float
    gap: float
    volume: float
    check_flow: float


class Endwards(NamedTuple):
    """The piston's distance to both ends, the trapped oil, and the state of the chambers' oil."""

    velocity: float
    left_a: float
    left_b: float
    excess_a: float
    excess_b: float
    pressure_rate_a: float
    pressure_rate_b: float
    bulk_modulus_a: float
    bulk_modulus_b: float


@register_jitable
def gap_flow(excess: float, left: float, viscosity: float, plunger: Plunger, oil: Oil) -> float:
    """Return the flow out of the trapped oil, through gap and check valve [m³/s].

    dp = 12 mu l q/(pi d c³) + rho/2 (q/(C_d pi d c))², with the second term for the mouth of the
    gap, is written as dp = q²/K² + 2 √w q/K and solved for q. The check valve opens fully within
    5 bar.
    """
    if left >= plunger.length:
        return 0.0
    around = math.pi * plunger.diameter * plunger.gap
    gain = DISCHARGE * around * math.sqrt(2.0 / oil.oil_density)
    mu = oil.oil_density * oil.oil_kinematic_viscosity * viscosity
    resistance = 12.0 * mu * (plunger.length - left) / (around * plunger.gap * plunger.gap)
    half = 0.5 * resistance * gain
    width = half * half + LEAST_WIDTH
    flow = gain * (math.sqrt(abs(excess) + width) - math.sqrt(width))
    inwards = plunger.check_flow * max(0.0, -excess) / 5e5
    return math.copysign(flow, excess) - inwards


@register_jitable
def trapped_rate(
    flow: float, left: float, closing: float, area: float, modulus: float, plunger: Plunger
) -> float:
    """Return the rate of the trapped oil's pressure [Pa/s], not relative to its chamber.

    `closing` is the speed towards the end [m/s].
    """
    trapped = plunger.share * area
    return modulus / (plunger.volume + trapped * left) * (trapped * closing - flow)


def _rates(
    viscosity: float, to: Endwards, plunger: Plunger, oil: Oil, cylinder_piston_area: float,
    cylinder_area_ratio: float,
) -> tuple[float, float]:  # fmt: skip
    """Continuity in both trapped volumes; outside the bores their pressure is the chamber's."""
    rate_a, rate_b = -to.excess_a / RELEASE, -to.excess_b / RELEASE
    if to.left_a < plunger.length:
        flow = gap_flow(to.excess_a, to.left_a, viscosity, plunger, oil)
        rate_a = trapped_rate(flow, to.left_a, -to.velocity, cylinder_piston_area,
                              to.bulk_modulus_a, plunger) - to.pressure_rate_a  # fmt: skip
    if to.left_b < plunger.length:
        area = cylinder_area_ratio * cylinder_piston_area
        flow = gap_flow(to.excess_b, to.left_b, viscosity, plunger, oil)
        rate_b = trapped_rate(flow, to.left_b, to.velocity, area, to.bulk_modulus_b,
                              plunger) - to.pressure_rate_b  # fmt: skip
    return rate_a, rate_b


def _flow_a(left: float, viscosity: float, excess_a: float, plunger: Plunger, oil: Oil) -> float:
    return gap_flow(excess_a, left, viscosity, plunger, oil)


def _flow_b(left: float, viscosity: float, excess_b: float, plunger: Plunger, oil: Oil) -> float:
    return gap_flow(excess_b, left, viscosity, plunger, oil)


def _pressure_a(pressure: float, excess_a: float) -> float:
    return max(0.0, pressure + excess_a)


def _pressure_b(pressure: float, excess_b: float) -> float:
    return max(0.0, pressure + excess_b)


def _port_area(area: float, left: float, length: float, share: float) -> float:
    """Area of the plunger, once it separates the port from the rest of the piston."""
    return area * (1.0 - share) if left < length else area


@effect(
    stop,
    knob=Param("length", "m", "length of the plunger at each end", 10e-3, 0.0, 1.0, shown="mm"),
    shape=(
        Param("share", "1", "part of a chamber's area that is cut off from the port", 0.7, 0.05,
              0.95, shown="%", default=0.7, spread=factor(1.2)),
        Param("diameter", "m", "diameter of the plunger", 9e-3, 1e-3, 1.0, shown="mm",
              default=9e-3, spread=factor(1.3)),
        Param("gap", "m", "radial gap between plunger and bore", 5e-5, 5e-6, 1e-3, shown="um",
              default=5e-5, spread=factor(2.0)),
        Param("volume", "m^3", "trapped oil that is left at the end of the stroke", 1e-6, 1e-8,
              1e-2, shown="ml", default=1e-6, spread=factor(2.0)),
        Param("check_flow", "m^3/s", "flow of the check valve towards the chamber at 5 bar",
              2e-3 / 60.0, 0.0, 0.1, shown="l/min", default=2e-3 / 60.0, spread=factor(2.0)),
    ),
    states=(
        Quantity("excess_a", "Pa", "pressure of trapped oil over that of chamber a"),
        Quantity("excess_b", "Pa", "pressure of trapped oil over that of chamber b"),
    ),
    source="continuity of a trapped volume (Merritt 1967) with laminar flow in a concentric gap, "
           "12 mu l q/(pi d c³), and Bernoulli's loss at its mouth; sizes assumed",
    signature="at the ends pressure of the trapped oil peaks beyond the supply's, the rod slows, "
              "and leaves them slowly while the check valve fills",
    not_modelled="eccentric plungers, a taper, throttling before the plunger enters; vapour and "
                 "air in the trapped oil: it is as stiff as its chamber's; unlike ends",
    also=((port_area, _port_area), (cushion_flow_a, _flow_a), (cushion_flow_b, _flow_b),
          (cushion_a, _pressure_a), (cushion_b, _pressure_b), (cushion_rates, _rates)),
)  # fmt: skip
def cushion_plunger(
    excess_a: float, excess_b: float, share: float, cylinder_piston_area: float,
    cylinder_area_ratio: float,
) -> float:  # fmt: skip
    """V_c/E dp_c/dt = s A v - q,  p_c - p = 12 mu l q/(pi d c³) + rho/2 (q/(C_d pi d c))².

    A plunger traps oil at the ends of the stroke, which brakes the rod.
    """
    return share * cylinder_piston_area * (excess_a - cylinder_area_ratio * excess_b)


EFFECTS = (cushion_plunger,)
