"""Parts around the valve: compensator, lines, load-holding valves, relief valves of chambers."""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.effects.supply import Line, Oil, form_loss, line_shape
from hil_emulator.model.stages import (
    cross_relief,
    cylinder_line_rates,
    holding,
    holding_rates,
    kept_drop,
    line_a,
    line_b,
    line_flow_a,
    line_flow_b,
    port_relief,
)

BLASIUS_REYNOLDS = (64.0 / 0.3164) ** (4.0 / 3.0)
"""Reynolds number at which lambda = 64/Re and 0.3164/Re^¼ meet (1187, below the real 2300)."""


class Swings(NamedTuple):
    """States of both lines."""

    flow_a: float
    excess_a: float
    flow_b: float
    excess_b: float


class Ends(NamedTuple):
    """Pressures at both ends of both lines, flows at the valve, the chambers' states and rates."""

    port_a: float
    port_b: float
    block_a: float
    block_b: float
    port_flow_a: float
    port_flow_b: float
    chamber_a: float
    chamber_b: float
    chamber_rate_a: float
    chamber_rate_b: float


@register_jitable
def friction_rise(reynolds: float) -> float:
    """Return the loss in a smooth pipe over the laminar loss: 1, or that of Blasius if larger."""
    if reynolds <= BLASIUS_REYNOLDS:
        return 1.0
    root = math.sqrt(reynolds)
    return 0.3164 / 64.0 * root * math.sqrt(root)


@register_jitable
def line_loss(flow: float, area: float, line: Line, viscosity: float, oil: Oil) -> float:
    """Return the pressure lost in a line with a smooth wall and in its bends and fittings [Pa].

    dp = (lambda l/d + zeta) rho v²/2, lambda the larger of 64/Re (Hagen-Poiseuille) and 0.3164/Re^¼
    (Blasius).
    """
    nu = oil.oil_kinematic_viscosity * viscosity
    speed = flow / area
    laminar = 32.0 * oil.oil_density * nu * line.length * speed / (line.diameter * line.diameter)
    wall = laminar * friction_rise(abs(speed) * line.diameter / nu)
    return wall + form_loss(flow, area, line, oil.oil_density) * flow


def _line_rates(
    ends: Ends, swings: Swings, line: Line, viscosity: float, oil: Oil
) -> tuple[float, float, float, float]:
    """Rates of flow and pressure of the first mode of each line, closed by the valve."""
    area = 0.25 * math.pi * line.diameter * line.diameter
    inertance = oil.oil_density * line.length / area
    quarter_wave = 2.0 * line.length / (math.pi * line.wave_speed)
    capacity = quarter_wave * quarter_wave / inertance
    lost_a = line_loss(swings.flow_a, area, line, viscosity, oil)
    lost_b = line_loss(swings.flow_b, area, line, viscosity, oil)
    return (
        (ends.port_a - ends.block_a - lost_a) / inertance,
        (ends.port_flow_a - swings.flow_a) / capacity - ends.chamber_rate_a,
        (ends.block_b - ends.port_b - lost_b) / inertance,
        (swings.flow_b - ends.port_flow_b) / capacity - ends.chamber_rate_b,
    )


def _flow_a(drawn: float, flow_a: float) -> float:
    return flow_a


def _flow_b(drawn: float, flow_b: float) -> float:
    return flow_b


def _pressure_b(chamber: float, excess_b: float) -> float:
    return max(0.0, chamber + excess_b)


@effect(
    line_a,
    knob=Param("length", "m", "length of each line between valve and cylinder", 1.0, 0.0, 20.0),
    shape=line_shape(6e-3),
    states=(
        Quantity("flow_a", "m^3/s", "flow in the line to chamber a"),
        Quantity("excess_a", "Pa", "pressure at the valve's port a over that of the chamber"),
        Quantity("flow_b", "m^3/s", "flow in the line from chamber b"),
        Quantity("excess_b", "Pa", "pressure at the valve's port b over that of the chamber"),
    ),
    source="inertance rho l/A (Merritt 1967) with the capacity that puts the resonance on the "
           "quarter wave c/(4 l) of a line that the valve closes; loss by Hagen-Poiseuille and "
           "Blasius",
    signature="the chamber follows the valve's flow late, and the valve's port rings: 309 Hz for "
              "1 m",
    not_modelled="higher modes: a sudden stop surges by pi/2 of Joukowsky's rho c v; friction that "
                 "grows with frequency; vapour in the line; lines of different length. The first "
                 "mode leaves 1 - 4/pi² of a line's oil, which belongs into the dead volume",
    also=((line_b, _pressure_b), (line_flow_a, _flow_a), (line_flow_b, _flow_b),
          (cylinder_line_rates, _line_rates)),
)  # fmt: skip
def cylinder_lines(chamber: float, excess_a: float) -> float:
    """L dq/dt = p_v - p_c - dp(q),  C dp_v/dt = q_v - q,  L C = (2 l/(pi c))².

    Oil swings in the lines between valve and cylinder, and loses pressure there.
    """
    return max(0.0, chamber + excess_a)


@effect(
    kept_drop,
    knob=Param("setting", "Pa", "pressure difference that it keeps", 7e5, 1e5, math.inf,
               shown="bar", off=math.inf, difference=True),
    source="proportional directional valves with individual compensators, such as Danfoss PVG 32: "
           "7 bar over the edge from the pump; ideal and without delay",
    signature="the speed does not depend on load and supply while more than the setting is left",
    not_modelled="dynamics and droop of the compensator; its check valve; load sensing of the pump",
)  # fmt: skip
def pressure_compensator(drop: float, setting: float) -> float:
    """dp = min(dp, dp_c), at the edges s-a and s-b.

    A compensator ahead of the spool keeps its flow independent of load and supply.
    """
    return min(drop, setting)


@effect(
    cross_relief,
    knob=Param("setting", "Pa", "pressure difference at which they open", 180e5, 1e5, math.inf,
               shown="bar", off=math.inf, difference=True),
    shape=(
        Param("flow", "m^3/s", "flow at the override", 10e-3 / 60.0, 1e-6, 0.1, shown="l/min",
              default=10e-3 / 60.0, spread=SETTING),
        Param("override", "Pa", "pressure between opening and that flow", 20e5, 1e5, 200e5,
              shown="bar", default=20e5, spread=factor(2.0), difference=True),
    ),
    source="two direct-acting relief valves, crossed; characteristic taken as a straight line",
    signature="the difference of the chambers' pressures has a ceiling, and the rod gives way",
    not_modelled="dynamics and hysteresis of the valves",
)  # fmt: skip
def cross_port_relief(
    pressure_a: float, pressure_b: float, setting: float, flow: float, override: float
) -> float:
    """q_ab = q_0 max(0, |p_a - p_b| - p_set)/dp_o sign(p_a - p_b).

    Relief valves between both chambers' lines let an overload through.
    """
    difference = pressure_a - pressure_b
    over = max(0.0, abs(difference) - setting)
    return math.copysign(flow * over / override, difference)


@effect(
    port_relief,
    knob=Param("setting", "Pa", "pressure over the return line at which they open", 180e5, 1e5,
               math.inf, shown="bar", off=math.inf, difference=True),
    shape=(
        Param("flow", "m^3/s", "flow at the override", 10e-3 / 60.0, 1e-6, 0.1, shown="l/min",
              default=10e-3 / 60.0, spread=SETTING),
        Param("override", "Pa", "pressure between opening and that flow", 20e5, 1e5, 200e5,
              shown="bar", default=20e5, spread=factor(2.0), difference=True),
    ),
    source="direct-acting relief valve at each chamber; characteristic taken as a straight line",
    signature="each chamber's pressure has a ceiling, and the rod gives way",
    not_modelled="dynamics and hysteresis of the valves",
)  # fmt: skip
def port_relief_valves(
    pressure: float, tank_pressure: float, setting: float, flow: float, override: float
) -> float:
    """q_at = q_0 max(0, p_a - p_t - p_set)/dp_o, the same for b.

    Relief valves let a chamber's overload into the return line.
    """
    return flow * max(0.0, pressure - tank_pressure - setting) / override


@effect(
    port_relief,
    knob=Param("flow", "m^3/s", "flow at the override", 5e-3 / 60.0, 0.0, 0.1, shown="l/min"),
    shape=(
        Param("cracking", "Pa", "pressure under that of the return line at which they open",
              0.2e5, 0.0, 5e5, shown="bar", default=0.2e5, spread=factor(2.0),
              difference=True),
        Param("override", "Pa", "pressure between opening and the full flow", 5e5, 1e4, 50e5,
              shown="bar", default=5e5, spread=factor(2.0), difference=True),
    ),
    source="check valve from the return line to each chamber; characteristic taken as a straight "
           "line, sizes assumed",
    signature="a chamber that the rod empties stays near the return line's pressure",
    not_modelled="inertia of the valves",
)  # fmt: skip
def anti_cavitation(
    pressure: float, tank_pressure: float, flow: float, cracking: float, override: float
) -> float:
    """q_ta = q_0 max(0, p_t - dp_c - p_a)/dp_o, the same for b.

    Check valves fill a chamber from the return line before it cavitates.
    """
    return -flow * max(0.0, tank_pressure - cracking - pressure) / override


class Poppets(NamedTuple):
    """Openings of the pilot-operated check valves of both chambers."""

    open_a: float
    open_b: float


class PilotCheck(NamedTuple):
    """Parameters of a pilot-operated check valve, see `pilot_check_valves`."""

    ratio: float
    cracking: float
    lift: float


@register_jitable
def poppet_target(before: float, behind: float, pilot: float, check: PilotCheck) -> float:
    """Return the steady poppet opening: p_v + k max(0, p_x - p_v) against p_c and the spring."""
    push = before + check.ratio * max(0.0, pilot - before) - behind - check.cracking
    return max(0.0, min(1.0, push / check.lift))


def _poppet_rates(
    block_a: float, block_b: float, pressure_a: float, pressure_b: float, poppets: Poppets,
    check: PilotCheck, time_constant: float,
) -> tuple[float, float]:  # fmt: skip
    """First-order rates of both poppets; the pilot is the other chamber's line."""
    return (
        (poppet_target(block_a, pressure_a, block_b, check) - poppets.open_a) / time_constant,
        (poppet_target(block_b, pressure_b, block_a, check) - poppets.open_b) / time_constant,
    )


@effect(
    holding,
    knob=Param("ratio", "1", "area of the pilot's piston over that of the seat", 4.0, 0.0, 20.0),
    shape=(
        Param("chamber", "1", "held chamber: 1 a, -1 b, 0 both", 0.0, -1.0, 1.0, default=0.0,
              spread=SETTING),
        Param("cracking", "Pa", "pressure of the spring", 2e5, 0.0, 20e5, shown="bar", default=2e5,
              spread=factor(1.5), difference=True),
        Param("lift", "Pa", "pressure between opening and fully open", 5e5, 1e5, 50e5, shown="bar",
              default=5e5, spread=factor(2.0), difference=True),
        Param("time_constant", "s", "time in which the poppet follows its forces", 5e-3, 1e-3, 0.1,
              shown="ms", default=5e-3, spread=factor(2.0)),
    ),
    states=(
        Quantity("open_a", "1", "opening of the valve of chamber a"),
        Quantity("open_b", "1", "opening of the valve of chamber b"),
    ),
    source="forces on seat, spring and pilot piston, which the line's pressure holds back; first "
           "order and sizes assumed",
    signature="a chamber keeps its pressure for any valve opening, until its other line is under "
              "pressure",
    not_modelled="mass of the poppet; leakage over the seat; air in the block",
    also=((holding_rates, _poppet_rates),),
)  # fmt: skip
def pilot_check_valves(
    opening: float, side: float, open_a: float, open_b: float, chamber: float
) -> float:
    """h = clip((p_v + k max(0, p_x - p_v) - p_c - dp_c)/dp_h, 0, 1), tau dh'/dt = h - h'.

    A check valve holds the load until the other line's pressure opens it.
    """
    if chamber * side < 0.0:
        return opening
    return opening * (open_a if side > 0.0 else open_b)


def _shut_off_rate(lines_closed: float, shut: float, closing_time: float) -> float:
    """Full travel takes the closing time; the last 1 % is approached exponentially."""
    return max(-1.0, min(1.0, (lines_closed - shut) / 0.01)) / closing_time


@effect(
    holding,
    knob=Param("closing_time", "s", "time from open to closed", 0.05, 0.0, 10.0, shown="ms"),
    states=(Quantity("shut", "1", "part of the way on which it has closed"),),
    source="seat valve with a solenoid, opening linear in time; commanded by `closed`",
    signature="both chambers keep their oil after the command to close",
    not_modelled="leakage over the seat; air in the block",
    also=((holding_rates, _shut_off_rate),),
)  # fmt: skip
def shut_off_valves(opening: float, shut: float) -> float:
    """h = 1 - z,  |dz/dt| <= 1/T towards its command.

    Shut-off valves close the lines between valve and cylinder.
    """
    return opening * (1.0 - shut)


EFFECTS = (
    cylinder_lines, cross_port_relief, port_relief_valves, anti_cavitation, pilot_check_valves,
    shut_off_valves, pressure_compensator,
)  # fmt: skip
