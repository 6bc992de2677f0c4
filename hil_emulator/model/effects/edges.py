"""The four metering edges of the valve."""

import math

from hil_emulator.model.declare import Param, effect
from hil_emulator.model.stages import discharge, metering


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
    knob=Param("lap", "A", "spool travel before an edge opens", 1e-4, 0.0, 2e-3, shown="mA"),
    source="S1 Fig. 3.3",
    signature="chamber pressures and velocity stay flat around null",
    not_modelled="different laps on the four edges",
)
def overlap(opening: float, lap: float) -> float:
    """u_i = u_i - u_lap, on each of the four edges.

    The valve has a dead band: its lands overlap the ports.
    """
    return opening - lap


@effect(
    metering,
    knob=Param("lap", "A", "opening of every edge at null", 28e-6, 0.0, 1e-3, shown="uA"),
    source="S1 3.5.1: K_p = p_s/u_0 = 5.7e11 Pa/A at 160 bar gives u_0 = 28 uA",
    signature="slope of pressure against current at null, damping, leakage s -> t at null",
    not_modelled="laminar flow in the clearance of a closed edge",
)
def underlap(opening: float, lap: float) -> float:
    """u_i = u_i + u_0, on each of the four edges.

    The valve is open at null: its lands are shorter than the ports.
    """
    return opening + lap


@effect(
    metering,
    knob=Param("passage", "A", "opening at which the passages resist as much as the edge",
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
    discharge,
    knob=Param("critical_flow_number", "1", "flow number lambda_c where C_d nears its limit",
               200.0, 0.0, 2000.0),
    shape=(
        Param("slot_per_ampere", "m/A", "edge opening per ampere of spool travel",
              0.025, 1e-4, 1.0, default=0.025),
    ),
    source="C_d = C_inf tanh(2 lambda/lambda_c) as in HyLib and Simscape; chosen over tables of "
           "C_d(Re) because it is smooth; 0.25 mm at 10 mA assumed",
    signature="flow falls below the square-root law at small openings, drops and in cold oil",
    not_modelled="hysteresis between laminar and turbulent flow",
)  # fmt: skip
def reynolds_discharge(
    coefficient: float, opening: float, drop: float, viscosity: float, critical_flow_number: float,
    slot_per_ampere: float, oil_density: float, oil_kinematic_viscosity: float,
) -> float:  # fmt: skip
    """C_d/C_inf = tanh(2 lambda/lambda_c),  lambda = (D_h/nu) sqrt(2 |dp|/rho),  D_h = 2 x.

    The flow is laminar at small openings.
    """
    diameter = 2.0 * slot_per_ampere * opening
    speed = math.sqrt(2.0 * abs(drop) / oil_density)
    flow_number = diameter * speed / (oil_kinematic_viscosity * viscosity)
    return coefficient * math.tanh(2.0 * flow_number / critical_flow_number)


EFFECTS = (gain_asymmetry, overlap, underlap, flow_saturation, reynolds_discharge)
