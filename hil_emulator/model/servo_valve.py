"""The servo-valve: a spool, and four metering edges between supply, tank and the two ports.

Signs and the arguments of every function as in `actuator`.
"""

import math
from typing import Any

from hil_emulator.model.constants import DISCHARGE, LEAST_OPENING
from hil_emulator.model.stages import (
    command,
    driver,
    edge_at,
    edge_at_acts,
    edge_bt,
    edge_bt_acts,
    edge_law,
    edge_law_acts,
    edge_sa,
    edge_sa_acts,
    edge_sb,
    edge_sb_acts,
    kept_drop,
    metering,
    pilot,
    pilot_flow,
    spool,
    spool_force,
    spool_reach,
    travel,
)


def transition(par: Any, viscosity: float) -> float:
    """Return opening times root of the drop at which an edge becomes turbulent [A Pa^½].

    Re = D_h v/nu, with D_h = 2 x, twice the slot's height, and v = C_d sqrt(2 dp/rho) (S2 eq. 5,
    alpha_d(Re)), depends only on this product: Re_c = 2 s u C_d sqrt(2 dp/rho)/nu.
    """
    nu = par.oil_kinematic_viscosity * viscosity
    slot = 2.0 * par.valve_slot_per_ampere * DISCHARGE
    number = par.valve_critical_reynolds_number
    product: float = number * nu * math.sqrt(0.5 * par.oil_density) / slot
    return product


def move_spool(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Move a second-order spool with unity gain (S1 eq. 3.4)."""
    u_v = spool_reach(par, x, dx, x.spool_position)
    commanded = driver(par, x, dx, held.valve_current, u_v)
    current = command(par, x, dx, commanded, y.supply_pressure)
    bandwidth_factor = pilot(par, x, dx, 1.0, y.supply_pressure)
    speed = x.spool_speed
    difference = y.port_pressure_a - y.port_pressure_b
    if u_v <= 0.0:
        difference = -difference
    drop = y.supply_pressure - y.tank_pressure - difference
    deviation = spool_force(par, x, dx, current - u_v, u_v, drop)
    w = 2.0 * math.pi * par.valve_natural_frequency * bandwidth_factor
    dx.spool_position = spool(par, x, dx, speed, bandwidth_factor)
    dx.spool_speed = w * w * deviation - 2.0 * par.valve_damping_ratio * w * speed
    y.valve_current = current
    y.spool_position = u_v
    y.spool_speed = dx.spool_position


def edge_flow(par: Any, held: Any, opening: float, drop: float) -> float:
    """Flow through one metering edge (S1 eq. 3.6), in either direction [m³/s].

    q = K u dp/(dp² + (T/u)⁴ + w²)^¼ is turbulent, K u sqrt(|dp|), far from zero, and laminar,
    q ~ u² dp, below a Reynolds number. At |dp| = 10 (T/u)² it is 0.25 % low. Below the width w it
    is always laminar: a fully open sharp edge of the reference machine is laminar only below
    0.02 bar, and a stalled chamber behind it would need steps of 4 us, proportional to the root of
    this pressure. Written with u² in numerator and denominator it has one division, which waits for
    one root only. It is also computed for a closed edge, so that two edges take the time of one.
    """
    width = par.valve_laminar_width
    laminar = held.transition * held.transition
    least = max(opening, LEAST_OPENING)
    square = least * least
    fourth = square * square
    bent = fourth * drop * drop + (fourth * (width * width) + laminar * laminar)
    root = math.sqrt(bent)
    flow: float = par.valve_gain * square * drop / root * math.sqrt(root)
    return flow if opening >= LEAST_OPENING else 0.0


def metered_flow(x: Any, dx: Any, par: Any, held: Any, opening: float, drop: float) -> float:
    """Flow through one metering edge with the effects of its law [m³/s]."""
    flow = edge_flow(par, held, opening, drop)
    if edge_law_acts(par) and held.transition > 0.0:
        root = opening / held.transition
        flow = edge_law(par, x, dx, flow, root * root * abs(drop))
    return flow


def open_edges(x: Any, dx: Any, par: Any, u: float) -> tuple[float, float, float, float]:
    """Return the openings of the edges s-a, b-t, s-b and a-t at a spool travel [A].

    Without effects of single edges they open in pairs.
    """
    if edge_sa_acts(par) or edge_bt_acts(par) or edge_sb_acts(par) or edge_at_acts(par):
        return (
            metering(par, x, dx, edge_sa(par, x, dx, u), u),
            metering(par, x, dx, edge_bt(par, x, dx, u), u),
            metering(par, x, dx, edge_sb(par, x, dx, -u), u),
            metering(par, x, dx, edge_at(par, x, dx, -u), u),
        )
    opens = metering(par, x, dx, u, u)
    closes = metering(par, x, dx, -u, u)
    return opens, opens, closes, closes


def orifice_flows(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Four metering edges (S1 eq. 3.9, 3.10, with flow in both directions through each)."""
    p_s = y.supply_pressure
    p_t = y.tank_pressure
    p_a = y.port_pressure_a
    p_b = y.port_pressure_b
    u = travel(par, x, dx, y.spool_position, y.spool_speed)
    u_sa, u_bt, u_sb, u_at = open_edges(x, dx, par, u)
    q_sa = metered_flow(x, dx, par, held, u_sa, kept_drop(par, x, dx, p_s - p_a))
    q_bt = metered_flow(x, dx, par, held, u_bt, p_b - p_t)
    q_sb = metered_flow(x, dx, par, held, u_sb, kept_drop(par, x, dx, p_s - p_b))
    q_at = metered_flow(x, dx, par, held, u_at, p_a - p_t)
    q_st = pilot_flow(par, x, dx, p_s, p_t)
    y.port_flow_a = q_sa - q_at
    y.port_flow_b = q_bt - q_sb
    y.pilot_flow = q_st
    y.supply_flow = q_sa + q_sb + q_st
    y.tank_flow = q_at + q_bt + q_st
    y.valve_loss = (
        q_sa * (p_s - p_a) + q_bt * (p_b - p_t) + q_sb * (p_s - p_b) + q_at * (p_a - p_t)
        + q_st * (p_s - p_t)
    )  # fmt: skip


SERVO_VALVE = (transition, move_spool, edge_flow, metered_flow, open_edges, orifice_flows)
"""What `kernel` compiles of this file, in the order of use."""
