"""Waves in the lines between valve and cylinder, as the first modes of a distributed line.

A line with given flow at the valve and given pressure at the chamber oscillates in the modes
cos((2n - 1) pi x/(2 l)): a quarter wave, three quarters, and so on. Each mode has two states, so a
line is an ordinary differential equation without a delay line or a separate step.
"""

import math
from typing import NamedTuple

from numba.extending import register_jitable

from hil_emulator.model.declare import Param, Quantity, effect
from hil_emulator.model.effects.lines import Ends, friction_rise
from hil_emulator.model.effects.supply import Line, Oil, form_loss, line_shape
from hil_emulator.model.stages import cylinder_line_rates, line_a, line_b, line_flow_a, line_flow_b

_MODES = 4
"""Number of modes of each line: a front takes l/(4 c). With six modes it would take two thirds of
this time, and need steps two thirds as wide."""

_ORDERS = [2 * n + 1 for n in range(_MODES)]

_SUMS = [8.0 / (math.pi * order) ** 2 for order in _ORDERS]
"""Shares of the modes in the inertance and in the oil of the line; those of all modes sum to 1."""


def _window(order: int) -> float:
    angle = math.pi * order / (2 * _MODES + 1)
    return math.sin(angle) / angle


WINDOW_1, WINDOW_2, WINDOW_3, WINDOW_4 = (_window(order) for order in _ORDERS)
"""Lanczos factors: they reduce the overshoot of a square wave with few modes from 18 % to 3 %
(Mäkinen, Piché and Ellman 2000)."""


def _share(order: int) -> float:
    sign = 2.0 - order % 4  # 1, -1, 1, -1
    return sign * 4.0 / (math.pi * order) * math.sqrt(_window(order) / sum(_SUMS))


SHARE_1, SHARE_2, SHARE_3, SHARE_4 = (_share(order) for order in _ORDERS)
"""Coupling of each mode with the chamber: at slow changes of pressure the line has its full
capacity, sum of share² C/(2 window) = C."""

SHARES = SHARE_1 + SHARE_2 + SHARE_3 + SHARE_4

STEADY = sum(s * _window(order) for s, order in zip(_SUMS, _ORDERS, strict=True))
"""Sum of the modes' shares in the pressure along the line."""

Four = tuple[float, float, float, float]


class FlowsA(NamedTuple):
    """Flow in each mode of the line to chamber a, from the valve."""

    flow_a1: float
    flow_a2: float
    flow_a3: float
    flow_a4: float


class PressuresA(NamedTuple):
    """Pressure in each mode at the valve, over the chamber's state times the mode's share."""

    pressure_a1: float
    pressure_a2: float
    pressure_a3: float
    pressure_a4: float


class FlowsB(NamedTuple):
    """The same flows of the line to chamber b, from the valve as well."""

    flow_b1: float
    flow_b2: float
    flow_b3: float
    flow_b4: float


class PressuresB(NamedTuple):
    """The same pressures of the line to chamber b."""

    pressure_b1: float
    pressure_b2: float
    pressure_b3: float
    pressure_b4: float


class Pipe(NamedTuple):
    """Common constants of a line's modes: frequency, inertance, capacity, losses."""

    pulsation: float
    """Angular frequency of the quarter wave [rad/s]."""
    inertance: float
    """rho l/A [kg/m⁴]."""
    capacity: float
    """V/(rho c²) [m³/Pa]."""
    laminar: float
    """Resistance of steady laminar flow [Pa s/m³]."""
    steady: float
    """Resistance at the present flow, corrected for the modes' share `STEADY` [Pa s/m³]."""
    shear: float
    """r √(2 omega/nu) of the quarter wave: √2 times its shear number."""


class Mode(NamedTuple):
    """One mode: its order 2n - 1, its constants, its states."""

    order: float
    window: float
    share: float
    flow: float
    pressure: float


class Boundary(NamedTuple):
    """Boundary conditions of a line."""

    inflow: float
    """From the valve [m³/s]."""
    lag: float
    """State of the chamber over the pressure at the line's end: vapour, or a holding valve [Pa]."""
    rate: float
    """Rate of the chamber's state [Pa/s]."""


@register_jitable
def pipe_of(flow: float, line: Line, viscosity: float, oil: Oil) -> Pipe:
    """Return the common constants of a line's modes at a flow [m³/s]."""
    nu = oil.oil_kinematic_viscosity * viscosity
    area = 0.25 * math.pi * line.diameter * line.diameter
    pulsation = 0.5 * math.pi * line.wave_speed / line.length
    inertance = oil.oil_density * line.length / area
    laminar = 32.0 * nu * inertance / (line.diameter * line.diameter)
    capacity = line.length * line.length / (line.wave_speed * line.wave_speed * inertance)
    rise = friction_rise(abs(flow) / area * line.diameter / nu)
    shear = 0.5 * line.diameter * math.sqrt(2.0 * pulsation / nu)
    steady = laminar * rise + form_loss(flow, area, line, oil.oil_density)
    return Pipe(pulsation, inertance, capacity, laminar, steady / STEADY, shear)


@register_jitable
def mode_rates(mode: Mode, end: Boundary, pipe: Pipe) -> tuple[float, float]:
    """Return the rates of a mode's flow and pressure.

    L_n dq_n/dt = p_n + h_n lag - loss,  dp_n/dt = 2 s_n (q - q_n)/C - h_n dp/dt; window s_n, share
    h_n. The oil's inertia and losses are those at the mode's frequency (Zielke 1968): for large k
    the impedance is rho s/A (1 + 2/k + 3/k²), k = r √(s/nu). Their excess over steady flow acts
    only on the difference between the mode's flow and the valve's flow.
    """
    shear = pipe.shear * math.sqrt(mode.order)
    inertia = pipe.inertance * (1.0 + min(1.0 / 3.0, 2.0 / shear))
    damping = pipe.laminar * max(1.0, 0.125 * shear + 0.375)
    stiffness = 0.5 * (0.5 * math.pi * mode.order) * (0.5 * math.pi * mode.order) / mode.window
    swing = mode.flow - end.inflow
    lost = pipe.steady * mode.flow + max(0.0, damping - pipe.steady) * swing
    return (
        (stiffness * (mode.pressure + mode.share * end.lag) - lost) / inertia,
        -2.0 * mode.window * swing / pipe.capacity - mode.share * end.rate,
    )


@register_jitable
def _line_rates(
    flows: Four, pressures: Four, end: Boundary, line: Line, viscosity: float, oil: Oil
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the rates of flow and pressure of each mode of a line."""
    q_1, q_2, q_3, q_4 = flows
    p_1, p_2, p_3, p_4 = pressures
    pipe = pipe_of(q_1, line, viscosity, oil)
    flow_1, pressure_1 = mode_rates(Mode(1.0, WINDOW_1, SHARE_1, q_1, p_1), end, pipe)
    flow_2, pressure_2 = mode_rates(Mode(3.0, WINDOW_2, SHARE_2, q_2, p_2), end, pipe)
    flow_3, pressure_3 = mode_rates(Mode(5.0, WINDOW_3, SHARE_3, q_3, p_3), end, pipe)
    flow_4, pressure_4 = mode_rates(Mode(7.0, WINDOW_4, SHARE_4, q_4, p_4), end, pipe)
    return flow_1, flow_2, flow_3, flow_4, pressure_1, pressure_2, pressure_3, pressure_4


def _rates(
    ends: Ends, flows_a: FlowsA, pressures_a: PressuresA, flows_b: FlowsB, pressures_b: PressuresB,
    line: Line, viscosity: float, oil: Oil,
) -> tuple[float, ...]:  # fmt: skip
    """Rates of the modes of both lines; flow out of chamber b is negative flow from the valve."""
    end_a = Boundary(ends.port_flow_a, ends.chamber_a - ends.block_a, ends.chamber_rate_a)
    end_b = Boundary(-ends.port_flow_b, ends.chamber_b - ends.block_b, ends.chamber_rate_b)
    a_1, a_2, a_3, a_4, a_5, a_6, a_7, a_8 = _line_rates(
        flows_a, pressures_a, end_a, line, viscosity, oil
    )
    b_1, b_2, b_3, b_4, b_5, b_6, b_7, b_8 = _line_rates(
        flows_b, pressures_b, end_b, line, viscosity, oil
    )
    return a_1, a_2, a_3, a_4, a_5, a_6, a_7, a_8, b_1, b_2, b_3, b_4, b_5, b_6, b_7, b_8


@register_jitable
def _delivered(inflow: float, flows: Four) -> float:
    """Return the flow at the chamber's end; the part outside the modes passes without delay."""
    q_1, q_2, q_3, q_4 = flows
    carried = SHARE_1 * q_1 + SHARE_2 * q_2 + SHARE_3 * q_3 + SHARE_4 * q_4
    return (1.0 - SHARES) * inflow + carried


@register_jitable
def _at_valve(pressure: float, chamber: float, pressures: Four) -> float:
    """Return the pressure at the valve's end [Pa]: that of the chamber's end plus the modes."""
    p_1, p_2, p_3, p_4 = pressures
    return max(0.0, pressure + SHARES * (chamber - pressure) + p_1 + p_2 + p_3 + p_4)


def _flow_a(drawn: float, flows_a: FlowsA) -> float:
    return _delivered(drawn, flows_a)


def _flow_b(drawn: float, flows_b: FlowsB) -> float:
    return -_delivered(-drawn, flows_b)


def _pressure_b(pressure: float, chamber: float, pressures_b: PressuresB) -> float:
    return _at_valve(pressure, chamber, pressures_b)


def _of_modes(kind: str, unit: str, meaning: str) -> tuple[Quantity, ...]:
    return tuple(
        Quantity(f"{kind}{n + 1}", unit, f"{meaning}, mode {n + 1}") for n in range(_MODES)
    )


@effect(
    line_a,
    knob=Param("length", "m", "length of each line between valve and cylinder", 1.0, 0.0, 20.0),
    shape=line_shape(6e-3),
    states=(
        *_of_modes("flow_a", "m^3/s", "flow in the line to chamber a"),
        *_of_modes("pressure_a", "Pa", "pressure at the valve's port a over that of the chamber"),
        *_of_modes("flow_b", "m^3/s", "flow in the line to chamber b"),
        *_of_modes("pressure_b", "Pa", "pressure at the valve's port b over that of the chamber"),
    ),
    source="modal approximation of the distributed line (Hullender & Healey 1981; Mäkinen, Piché & "
           "Ellman 2000), four modes; losses by Hagen-Poiseuille and Blasius, those of each mode "
           "by Zielke (1968)",
    signature="a sudden stop surges by rho c v, and comes back from the chamber as a square wave: "
              "309 Hz, 928 Hz and on for 1 m",
    not_modelled="a front steeper than l/(4 c); of the inertance 11 %, that of modes beyond the "
                 "fourth; damping of modes by turbulence; vapour in the line; lines of different "
                 "length",
    also=((line_b, _pressure_b), (line_flow_a, _flow_a), (line_flow_b, _flow_b),
          (cylinder_line_rates, _rates)),
)  # fmt: skip
def line_waves(pressure: float, chamber: float, pressures_a: PressuresA) -> float:
    """p_v = p_c + sum p_n,  p_n' = 2 s_n (q_v - q_n)/C - h_n p_c',  q_n' = (p_n - dp_n)/L_n.

    Waves run in the lines between valve and cylinder, and lose pressure there.
    """
    return _at_valve(pressure, chamber, pressures_a)


EFFECTS = (line_waves,)
