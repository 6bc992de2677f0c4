"""The four metering edges of the valve."""

import math

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import edge_law, metering

LARGEST_TURBULENCE = 1e12
"""Ratio of pressure drop and transition above which the laws of an edge agree to 1e-6."""


@effect(
    metering,
    knob=Param("asymmetry", "1", "half the relative difference of both gains", 0.05, -0.3, 0.3),
    source="servo-valve specification (symmetry, up to 10 % of the gain)",
    signature="both chamber flows scale with the direction of the spool",
)
def gain_asymmetry(opening: float, travel: float, asymmetry: float) -> float:
    """u_i = u_i (1 + k sign(u_v)).

    The valve opens further to one side than to the other.
    """
    return opening * (1.0 + asymmetry * math.copysign(1.0, travel))


@effect(
    metering,
    knob=Param("lap", "A", "spool travel before an edge opens", 1e-4, 0.0, 6e-3, shown="mA"),
    source="S1 Fig. 3.3",
    signature="chamber pressures and velocity stay flat around null",
    not_modelled="different laps on the four edges, see `lap_sa` and its like",
)
def overlap(opening: float, lap: float) -> float:
    """u_i = u_i - u_lap, on each of the four edges.

    The valve has a dead band: its lands overlap the ports.
    """
    return opening - lap


@effect(
    metering,
    knob=Param("lap", "A", "opening of every edge at null", 28e-6, 0.0, 5e-3, shown="uA"),
    source="S1 3.5.1: K_p = p_s/u_0 = 5.7e11 Pa/A at 160 bar gives u_0 = 28 uA",
    signature="slope of pressure against current at null, damping, leakage s -> t at null",
    not_modelled="the clearance of a closed edge, see `land_leakage`",
)
def underlap(opening: float, lap: float) -> float:
    """u_i = u_i + u_0, on each of the four edges.

    The valve is open at null: its lands are shorter than the ports.
    """
    return opening + lap


@effect(
    metering,
    knob=Param("clearance", "A", "opening equivalent to the clearance of each land at null",
               28e-6, 0.0, 1e-2, shown="uA",
               source="S1 3.5.1: K_p = p_s/u_c = 5.7e11 Pa/A at 160 bar"),
    source="shape: Eryilmaz & Wilson 2006, falling as 1/(z + l) past an overlap z; here l = u_c/2, "
           "so that opening and closing edges have one slope at null and K_p = p_s/u_c",
    signature="slope of pressure against current at null, damping; leakage s -> t has a peak at "
              "null and a foot beyond it",
    not_modelled="eccentric spools, rounded edges, wear of single lands",
)  # fmt: skip
def land_leakage(opening: float, clearance: float) -> float:
    """u_i = u_i + u_c while u_i > 0,  u_i = u_c / sqrt(1 - 2 u_i/u_c) else.

    The valve's lands leak while they are closed, the less the more they overlap.

    Laminar flow is proportional to the square of the opening: past an overlap z = -u_i it decreases
    as 1/(z + u_c/2), as in a lengthening annular gap, q = w c³ dp/(12 mu z). By the law of the
    edges the radial clearance c of this gap is 0.84 of the slot at u_c.
    """
    if opening > 0.0:
        return opening + clearance
    return clearance * math.sqrt(clearance / (clearance - 2.0 * opening))


@effect(
    metering,
    knob=Param("passage", "A", "opening at which passages and edge have the same resistance",
               0.03, 1e-3, math.inf, shown="mA", off=math.inf),
    source="edge and fixed passage in series: 1/g² = 1/g_1² + 1/g_2²; size assumed",
    signature="flow grows less than the spool at large openings",
)  # fmt: skip
def flow_saturation(opening: float, passage: float) -> float:
    """u_i = u_i / sqrt(1 + (u_i/u_p)²).

    The valve's flow grows less at large openings.
    """
    ratio = opening / passage
    return opening / math.sqrt(1.0 + ratio * ratio)


@effect(
    edge_law,
    knob=Param("share", "1", "share of the series law in the flow", 1.0, 0.0, 1.0),
    source="laminar and turbulent resistance in series (Borutzky, Barnard and Thoma 2002)",
    signature="less flow, by up to a quarter, where an edge turns from laminar to turbulent",
    not_modelled="hysteresis of the transition between laminar and turbulent flow",
)  # fmt: skip
def series_resistance(flow: float, turbulence: float, share: float) -> float:
    """q = q (1 + k (f - 1)),  f = (1 + r²)^¼ / (sqrt(r + 1/4) + 1/2),  r = u² dp/T².

    The laminar and the turbulent pressure drop of an edge add up.

    For k = 1, and a drop that is large against the laminar width, q solves
    dp = (q/(K u))² + T q/(K u²). It has the limits of the law of the edges, for small and for large
    drops, and less flow between them.
    """
    r = min(turbulence, LARGEST_TURBULENCE)
    series = math.sqrt(math.sqrt(1.0 + r * r)) / (math.sqrt(r + 0.25) + 0.5)
    return flow * (1.0 + share * (series - 1.0))


EFFECTS = (
    gain_asymmetry, overlap, underlap, land_leakage, flow_saturation, series_resistance,
)  # fmt: skip
