"""Pumps, relief valve, accumulator and the lines to and from the valve.

Without a pump the supply is ideal: the pressure is the set pressure at any flow. A pump has a check
valve at its outlet, so flow pushed back by a load passes the relief valve.
"""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.stages import (
    capacity,
    full_flow,
    line_flow,
    line_rates,
    pilot_flow,
    pump_drag,
    pump_loss,
    relief,
    return_rates,
    source,
    supply,
    tank,
)


def relief_valve(
    pump_pressure: float, flow: float, override: float, supply_pressure: float
) -> float:
    """q_r = q_0 max(0, 1 + (p - p_set)/dp_o)."""
    return flow * max(0.0, 1.0 + (pump_pressure - supply_pressure) / override)


def safety_valve(
    pump_pressure: float, flow: float, relief_margin: float, relief_override: float,
    supply_pressure: float,
) -> float:  # fmt: skip
    """q_r = q_max max(0, (p - p_set - dp_m)/dp_o)."""
    return flow * max(0.0, (pump_pressure - supply_pressure - relief_margin) / relief_override)


def displaced(flow: float) -> float:
    """q_0 of either pump."""
    return flow


@effect(
    source,
    knob=Param("flow", "m^3/s", "flow of the pump", 10e-3 / 60.0, 1e-6, math.inf, shown="l/min",
               off=math.inf),
    shape=(
        Param("override", "Pa", "pressure between opening and full flow of the relief valve",
              10e5, 2e5, 100e5, shown="bar", default=10e5, spread=factor(2.0), difference=True),
    ),
    source="S1 3.2: fixed displacement with relief valve; the whole flow passes it at set pressure",
    signature="supply pressure falls as flow is drawn, and collapses beyond the pump's flow",
    not_modelled="flow ripple; dynamics of the relief valve",
    also=((relief, relief_valve), (full_flow, displaced)),
)  # fmt: skip
def fixed_pump(flow: float) -> float:
    """V/beta dp/dt = q_0 - q - q_r,  q_r = q_0 max(0, 1 + (p - p_set)/dp_o).

    The pump delivers a limited flow.
    """
    return flow


@effect(
    source,
    knob=Param("flow", "m^3/s", "largest flow of the pump", 10e-3 / 60.0, 1e-6, math.inf,
               shown="l/min", off=math.inf),
    shape=(
        Param("droop", "Pa", "pressure between no and full stroke of the compensator",
              10e5, 2e5, 100e5, shown="bar", default=10e5, spread=factor(2.0), difference=True),
        Param("time_constant", "s", "time constant of the compensator", 0.02, 1e-3, 1.0, shown="ms",
              default=0.02, spread=factor(2.0)),
        Param("relief_margin", "Pa", "pressure over the set pressure at which its relief valve "
              "opens", 20e5, 0.0, 200e5, shown="bar", default=20e5, spread=factor(1.5),
              difference=True),
        Param("relief_override", "Pa", "pressure between opening and full flow of the relief valve",
              10e5, 2e5, 100e5, shown="bar", default=10e5, spread=factor(2.0), difference=True),
    ),
    states=(Quantity("stroke", "m^3/s", "flow of the pump"),),
    source="S1 3.2: pressure-compensated pump; first-order compensator and relief valve assumed",
    signature="supply pressure droops with flow and dips when the flow starts",
    not_modelled="flow ripple; different times for opening and closing; dynamics of the relief "
                 "valve",
    also=((relief, safety_valve), (full_flow, displaced)),
)  # fmt: skip
def variable_pump(
    pump_pressure: float, stroke: float, flow: float, droop: float, time_constant: float,
    supply_pressure: float,
) -> tuple[float, float]:  # fmt: skip
    """V/beta dp/dt = q_p - q - q_r,  tau dq_p/dt = q_max clip((p_set - p)/dp_d, 0, 1) - q_p.

    The pump's controller needs time and a pressure drop to deliver.
    """
    wanted = flow * max(0.0, min(1.0, (supply_pressure - pump_pressure) / droop))
    return stroke, (wanted - stroke) / time_constant


@effect(
    pump_loss,
    knob=Param("flow", "m^3/s", "leakage at 250 bar and 40 °C", 1e-3 / 60.0, 0.0, 1e-2,
               shown="l/min", source="S1 3.2: 90 % at 250 bar, of a pump of 10 l/min"),
    shape=(
        Param("widening_pressure", "Pa", "pressure at which the gaps are twice as wide as at rest",
              155.36e5, 10e5, 1e10, shown="bar", default=155.36e5,
              source="S1 3.2: 99 % at 100 bar and 90 % at 250 bar require "
                     "(250 bar - 4^(1/3) 100 bar) / (4^(1/3) - 1)", spread=factor(2.0)),
    ),
    source="laminar flow through a gap, w h³ dp/(12 mu l) (Merritt 1967): Wilson's slip dp/mu, its "
           "gap widening in proportion to pressure (assumed)",
    signature="pump power over supply power grows with pressure",
    not_modelled="gaps that change with speed and stroke",
)  # fmt: skip
def pump_leakage(
    pump_pressure: float, viscosity: float, flow: float, widening_pressure: float
) -> float:
    """q_l = q_250 (p/p_250) ((1 + p/p_h)/(1 + p_250/p_h))³ nu_40/nu,  p_250 = 250 bar.

    The pump loses more flow at higher pressure.
    """
    wider = (widening_pressure + pump_pressure) / (widening_pressure + 250e5)
    return flow * (pump_pressure / 250e5) * wider * wider * wider / viscosity


@effect(
    pump_drag,
    knob=Param("coefficient", "1", "torque of dry friction over that of the pressure at full "
               "stroke", 0.045, 0.0, 0.5, shown="%",
               source="assumed: with the drag, 90 % of pump_leakage's 97 % at 160 bar (S1 Table "
                      "3.1, which names no pressure)"),
    shape=(
        Param("drag", "Pa", "pressure equivalent to the drag of oil at 40 °C in the gaps at the "
              "shaft's speed", 5.22e5, 0.0, 100e5, shown="bar", default=5.22e5, spread=factor(2.0),
              difference=True),
    ),
    source="torque loss D (C_f p + C_d mu omega) of Wilson's pump (Merritt 1967); both of full "
           "displacement at any stroke",
    signature="only power: torque and power of the shaft, and the oil's temperature",
    not_modelled="friction that changes with pressure, speed or stroke; friction of seals; "
                 "breakaway; the charge pump",
)  # fmt: skip
def pump_friction(
    pump_pressure: float, full_flow: float, viscosity: float, coefficient: float, drag: float
) -> float:
    """T_l = D (c_f p + p_d nu/nu_40),  D = q_0/omega.

    The pump's shaft has to turn against friction.
    """
    return full_flow * (coefficient * pump_pressure + drag * viscosity)


@effect(
    capacity,
    knob=Param("gas_volume", "m^3", "gas volume at pre-charge", 4e-5, 0.0, 10.0, shown="l",
               source="0.04 l in a public HyQ bench script"),
    shape=(
        Param("precharge", "Pa", "pre-charge pressure, absolute", 100e5, 1e5, 600e5, shown="bar",
              default=100e5, source="public HyQ bench script", spread=factor(1.3)),
        Param("exponent", "1", "polytropic exponent", 1.4, 1.0, 1.4, default=1.4,
              source="public HyQ bench script", spread=factor(1.1)),
    ),
    source="p V^n = const",
    signature="a pump's pressure moves slowly above pre-charge; nothing on an ideal supply",
    not_modelled="throttling at the port, heat exchange of the gas",
)  # fmt: skip
def accumulator(
    pump_pressure: float, gas_volume: float, precharge: float, exponent: float
) -> float:
    """C = V_0/(n p) (p_0/p)^(1/n) above the pre-charge p_0, else 0.

    An accumulator feeds the supply.
    """
    if pump_pressure <= precharge:
        return 0.0
    gas: float = gas_volume * (precharge / pump_pressure) ** (1.0 / exponent)
    return gas / (exponent * pump_pressure)


class Line(NamedTuple):
    """A pipe: knob and shape parameters of the line effects."""

    length: float
    diameter: float
    wave_speed: float
    form_losses: float


def line_shape(diameter: float) -> tuple[Param, ...]:
    """Return the parameters of a line without its length, with a usual diameter [m]."""
    return (
        Param("diameter", "m", "inner diameter", diameter, 1e-3, 0.1, shown="mm", default=diameter,
              spread=factor(1.3)),
        Param("wave_speed", "m/s", "speed of pressure waves", 1237.0, 100.0, 1500.0,
              default=1237.0, source="sqrt(1300 MPa / 850 kg/m³)", spread=factor(1.2)),
        Param("form_losses", "1", "loss coefficients zeta of its bends, ports and fittings, summed",
              0.0, 0.0, 1000.0, default=0.0, source="S2 eq. 3-4: dp = zeta rho v²/2; a bend has "
              "0.2, an elbow 1, a sudden port 1.5", spread=SETTING),
    )  # fmt: skip


@register_jitable
def form_loss(flow: float, area: float, line: Line, density: float) -> float:
    """Return the resistance of bends and fittings to a flow, dp/q = zeta rho |q|/(2 A²)."""
    return 0.5 * line.form_losses * density * abs(flow) / (area * area)


class Oil(NamedTuple):
    """Properties of the oil at the reference temperature."""

    oil_density: float
    oil_kinematic_viscosity: float


def _line_rates(
    pump_pressure: float, drawn: float, viscosity: float, flow: float, excess: float, line: Line,
    supply_pressure: float, oil: Oil,
) -> tuple[float, float]:  # fmt: skip
    """Rates of flow and pressure of the first mode of a line, one end held, one end closed."""
    area = 0.25 * math.pi * line.diameter * line.diameter
    inertance = oil.oil_density * line.length / area
    quarter_wave = 2.0 * line.length / (math.pi * line.wave_speed)
    capacity = quarter_wave * quarter_wave / inertance
    # Hagen-Poiseuille: 128 mu l / (pi d^4)
    mu = oil.oil_density * oil.oil_kinematic_viscosity * viscosity
    resistance = 8.0 * math.pi * mu * line.length / (area * area)
    resistance += form_loss(flow, area, line, oil.oil_density)
    pressure = max(0.0, supply_pressure + excess)
    return (
        (pump_pressure - pressure - resistance * flow) / inertance,
        (flow - drawn) / capacity,
    )


def _line_flow(drawn: float, flow: float) -> float:
    """Flow that enters the line at the pump."""
    return flow


@effect(
    supply,
    knob=Param("length", "m", "length of the line between pump and valve", 2.0, 0.0, 50.0),
    shape=line_shape(8e-3),
    states=(
        Quantity("flow", "m^3/s", "flow in the line"),
        Quantity("excess", "Pa", "pressure at the valve over the set pressure"),
    ),
    source="inertance rho l/A (Merritt 1967) with the capacity that puts the resonance on the "
           "quarter wave c/(4 l): the first mode of the wave equation",
    signature="supply pressure rings after steps of flow: 155 Hz for 2 m",
    not_modelled="higher modes; friction that grows with frequency",
    also=((line_flow, _line_flow), (line_rates, _line_rates)),
)  # fmt: skip
def supply_line(excess: float, supply_pressure: float) -> float:
    """L dq/dt = p_0 - p_s - R q,  C dp_s/dt = q - q_s,  L C = (2 l/(pi c))².

    The oil swings in the supply line.
    """
    return max(0.0, supply_pressure + excess)


@effect(
    pilot_flow,
    knob=Param("conductance", "m^3/(s*Pa)", "conductance from s to t", 2.2e-13, 0.0, 1e-9,
               shown="cm^3/(min*bar)", source="public HyQ bench script: 0.28 l/min at 210 bar"),
    source="flow of the pilot stage, taken as proportional to pressure",
    signature="only power: supply flow at rest",
)  # fmt: skip
def pilot_leakage(port_s: float, port_t: float, conductance: float) -> float:
    """q_st = C_p (p_s - p_t).

    The pilot stage draws oil all the time.
    """
    return conductance * (port_s - port_t)


def _return_rates(returned: float, flow: float, time_constant: float) -> float:
    """dq_f/dt = (q_t - q_f) / tau."""
    return (returned - flow) / time_constant


@effect(
    tank,
    knob=Param("resistance", "Pa*s^2/m^6", "resistance of the return line", 3.2e13, 0.0, 1e16,
               shown="bar*min^2/l^2", source="5 bar at 7.5 l/min, assumed"),
    shape=(
        Param("time_constant", "s", "time in which the line's flow follows the valve's",
              1e-3, 1e-4, 0.1, shown="ms", default=1e-3, spread=factor(3.0)),
    ),
    states=(Quantity("flow", "m^3/s", "flow in the return line"),),
    source="turbulent line and filter: square law",
    signature="the chamber on the tank side rises with speed squared",
    not_modelled="waves in the return line",
    also=((return_rates, _return_rates),),
)  # fmt: skip
def back_pressure(port_pressure: float, flow: float, resistance: float) -> float:
    """p_t = p_t0 + R |q_f| q_f,  dq_f/dt = (q_t - q_f)/tau.

    The return line builds up pressure with its flow.
    """
    return max(0.0, port_pressure + resistance * abs(flow) * flow)


EFFECTS = (
    fixed_pump, variable_pump, pump_leakage, pump_friction, accumulator, supply_line, pilot_leakage,
    back_pressure,
)  # fmt: skip
