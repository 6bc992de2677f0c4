"""The servo valve between its coil current and its metering edges.

The spool position is expressed in ampere: the current that holds the spool there (S1 eq. 3.4).
"""

import math

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import command, metering, spool


@effect(
    command,
    knob=Param("limit", "A", "largest coil current", 0.01, 1e-4, math.inf, shown="mA"),
    off=math.inf,
    source="S1 3.3; rated current of the Moog E024 in public HyQ bench scripts",
    signature="flat tops of both chamber flows at large commands",
    not_modelled="the driver's supply voltage",
)
def current_saturation(current: float, limit: float) -> float:
    """u = max(-I_max, min(I_max, u))."""
    return max(-limit, min(limit, current))


@effect(
    command,
    knob=Param("bias", "A", "current that the null is off by", 1e-4, -2e-3, 2e-3, shown="mA"),
    source="standard servo-valve specification (null bias, up to 3 % of rated current)",
    signature="constant rate of both chamber pressures at zero command",
    not_modelled="drift of the null with temperature and supply pressure",
)
def null_bias(current: float, bias: float) -> float:
    """u = u + u_b."""
    return current + bias


@effect(
    spool,
    knob=Param("rate", "A/s", "fastest motion of the spool", 3.6, 0.05, math.inf),
    off=math.inf,
    source="S1 3.3.1: 250 Hz at ±25 %, 100 Hz at ±100 %; this one number gives both",
    signature="large, fast commands only: flow lags and turns triangular",
    not_modelled="dependence on the supply pressure that feeds the pilot stage",
)
def spool_rate_limit(spool_speed: float, rate: float) -> float:
    """du_v/dt = max(-R, min(R, du_v/dt))."""
    return max(-rate, min(rate, spool_speed))


@effect(
    metering,
    knob=Param("lap", "A", "spool travel before an edge opens", 1e-4, 0.0, 2e-3, shown="mA"),
    source="S1 Fig. 3.3",
    signature="chamber pressures and velocity stay flat around null",
    not_modelled="different laps on the four edges",
)
def overlap(opening: float, lap: float) -> float:
    """u_i = u_i - u_lap, on each of the four edges."""
    return opening - lap


@effect(
    metering,
    knob=Param("lap", "A", "opening of every edge at null", 28e-6, 0.0, 1e-3, shown="uA"),
    source="S1 3.5.1: K_p = p_s/u_0 = 5.7e11 Pa/A at 160 bar gives u_0 = 28 uA",
    signature="slope of pressure against current at null, damping, leakage p -> t at null",
    not_modelled="laminar flow in the clearance of a closed edge",
)
def underlap(opening: float, lap: float) -> float:
    """u_i = u_i + u_0, on each of the four edges."""
    return opening + lap


@effect(
    metering,
    knob=Param("asymmetry", "1", "half the relative difference of both gains", 0.05, -0.3, 0.3),
    source="servo-valve specification (symmetry, up to 10 % of the gain)",
    signature="both chamber flows scale with the direction of the spool",
)
def gain_asymmetry(opening: float, spool_position: float, asymmetry: float) -> float:
    """u_i = u_i (1 + k sign(u_v))."""
    return opening * (1.0 + asymmetry * math.copysign(1.0, spool_position))


EFFECTS = (
    current_saturation, null_bias, spool_rate_limit, gain_asymmetry, overlap, underlap,
)  # fmt: skip
