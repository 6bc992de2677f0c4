"""The balances of a valve-controlled asymmetric cylinder (S1 3.4, 3.6-3.19).

Sign convention, said once for the whole project (S1): x = 0 at the cap end, extension positive;
chamber a on the cap side, b on the rod side; q_a > 0 into a; q_b > 0 *out of* b; a positive spool
position connects s-a and b-t; f > 0 pushes the load. Pressures are absolute.

`kernel` compiles the functions of this file together with the effects of each stage; a stage is
called here by its name. In every function:

    par   parameters, constant
    held  inputs and what follows from parameters, constant during a call of the integrator
    x     state
    dx    its rates, filled
    y     signals, filled from top to bottom: what stands above may be read below
"""

import math
from typing import Any

from hil_emulator.model.constants import ATMOSPHERE, DISCHARGE, LEAST_OPENING
from hil_emulator.model.gas import GAS, follow_gas, hold_gas
from hil_emulator.model.mechanics import MECHANICS, move_rod
from hil_emulator.model.ports import PORTS, deliver, fill_lines, port_pressures
from hil_emulator.model.quantities import HELD, INPUTS, PARAMS, SIGNALS, STATES
from hil_emulator.model.stages import (
    capacity,
    command,
    cross_leakage,
    cross_relief,
    cushion_a,
    cushion_b,
    cushion_flow_a,
    cushion_flow_b,
    cushion_rates,
    edge_at,
    edge_at_acts,
    edge_bt,
    edge_bt_acts,
    edge_sa,
    edge_sa_acts,
    edge_sb,
    edge_sb_acts,
    full_flow,
    gas_pressure,
    heat,
    line_flow,
    line_rates,
    metering,
    oil,
    outward_leakage,
    pilot,
    pilot_flow,
    port_area,
    port_relief,
    pump_drag,
    pump_loss,
    relief,
    return_rates,
    source,
    source_acts,
    spool,
    spool_force,
    spool_reach,
    supply,
    tank,
    temperature,
    travel,
    vapour,
    viscosity,
)

__all__ = ["BALANCES", "HELD", "INPUTS", "PARAMS", "SIGNALS", "STATES"]


def transition(par: Any, viscosity: float) -> float:
    """Return opening times root of the drop at which an edge turns turbulent [A Pa^½].

    Re = D_h v/nu with D_h = 2 x, twice the slot's height, and v = C_d sqrt(2 dp/rho) (S2 eq. 5,
    alpha_d(Re)) only holds the product of both: Re_c = 2 s u C_d sqrt(2 dp/rho)/nu.
    """
    nu = par.oil_kinematic_viscosity * viscosity
    slot = 2.0 * par.valve_slot_per_ampere * DISCHARGE
    number = par.valve_critical_reynolds_number
    product: float = number * nu * math.sqrt(0.5 * par.oil_density) / slot
    return product


def hold(x: Any, par: Any, inputs: Any, held: Any) -> None:
    """Fill what stays constant during a call of the integrator."""
    held.valve_current = inputs.valve_current
    held.external_force = inputs.external_force
    held.transverse_force = inputs.transverse_force
    held.wall_shift = inputs.wall_shift
    held.temperature = temperature(par, x, held, par.oil_temperature)
    held.viscosity = viscosity(par, held, held, 1.0, held.temperature)
    held.gas_pressure = gas_pressure(par, held, held)
    held.per_gas_pressure = 1.0 / held.gas_pressure if held.gas_pressure > 0.0 else 0.0
    p_a = chamber_pressure(x.pressure_a, held.gas_pressure)
    p_b = chamber_pressure(x.pressure_b, held.gas_pressure)
    hold_gas(x, par, held, p_a, p_b)
    held.transition = transition(par, held.viscosity)


def move(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Evaluate the balances of valve, cylinder and load at one state, and the signals they need."""
    p_a, p_b = ports(x, dx, par, held, y)
    port_pressures(x, dx, par, y)
    move_spool(x, dx, par, held, y)
    meter(x, dx, par, held, y)
    deliver(x, dx, par, y)
    fill_chambers(x, dx, par, held, y, p_a, p_b)
    fill_lines(x, dx, par, held, y)
    move_rod(x, dx, par, held, y)


def chamber_pressure(state: float, gas: float) -> float:
    """Return the pressure that belongs to a chamber's state [Pa], never negative.

    s = p - g²/p: far above the gas pressure g the state is the pressure. Below, it goes on to
    large negative values as gas expands, so that a step of any width leaves p > 0 and the volume
    that opened must be filled again before the pressure rises. Without gas the corner is sharp.
    """
    if gas == 0.0:
        return max(0.0, state)
    square = gas * gas
    root = math.sqrt(state * state + 4.0 * square)
    return 0.5 * (state + root) if state > 0.0 else 2.0 * square / (root - state)


def ports(x: Any, dx: Any, par: Any, held: Any, y: Any) -> tuple[float, float]:
    """Set all pressures, from the states alone; return those of the chambers' states [Pa]."""
    p_pump = max(0.0, par.supply_pressure + x.pump_pressure)
    y.pump_pressure = p_pump
    y.supply_pressure = supply(par, x, dx, p_pump)
    y.tank_pressure = tank(par, x, dx, par.tank_pressure)
    p_a = chamber_pressure(x.pressure_a, held.gas_pressure)
    p_b = chamber_pressure(x.pressure_b, held.gas_pressure)
    y.pressure_a = vapour(par, x, dx, p_a)
    y.pressure_b = vapour(par, x, dx, p_b)
    return p_a, p_b


def move_spool(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Move a second-order spool with unity gain (S1 eq. 3.4)."""
    current = command(par, x, dx, held.valve_current, y.supply_pressure)
    bandwidth_factor = pilot(par, x, dx, 1.0, y.supply_pressure)
    u_v = spool_reach(par, x, dx, x.spool_position)
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
    q ~ u² dp, below a Reynolds number. At |dp| = 10 (T/u)² it is 0.25 % low. It is laminar below
    the width w in any case: fully open, a sharp edge of the reference machine is so below 0.02 bar
    alone, and a chamber stalled behind it would ask for steps of 4 us, as they shrink with the
    root of it. Written with u² above and below, it has one quotient, which waits for one root only;
    it is computed for a shut edge, too, so that two take the time of one.
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


def open_edges(x: Any, dx: Any, par: Any, u: float) -> tuple[float, float, float, float]:
    """Return the openings of the edges s-a, b-t, s-b and a-t at a spool travel [A].

    They open two by two where none is unlike the others.
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


def meter(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Four metering edges (S1 eq. 3.9, 3.10, with flow in both directions through each)."""
    p_s = y.supply_pressure
    p_t = y.tank_pressure
    p_a = y.port_pressure_a
    p_b = y.port_pressure_b
    u = travel(par, x, dx, y.spool_position, y.spool_speed)
    u_sa, u_bt, u_sb, u_at = open_edges(x, dx, par, u)
    q_sa = edge_flow(par, held, u_sa, p_s - p_a)
    q_bt = edge_flow(par, held, u_bt, p_b - p_t)
    q_sb = edge_flow(par, held, u_sb, p_s - p_b)
    q_at = edge_flow(par, held, u_at, p_a - p_t)
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


def gas_factor(pressure: float, state: float, per_gas: float) -> float:
    """Return ds/dp of `chamber_pressure`: how much faster the state moves than the pressure.

    It is 1 + (g/p)², and g/p is (p - s)/g.
    """
    ratio = (pressure - state) * per_gas
    return 1.0 + ratio * ratio


def leak(x: Any, dx: Any, par: Any, held: Any, y: Any) -> tuple[float, float, float]:
    """Leakage past the piston and out of either chamber [m³/s], see S1 eq. 3.11."""
    q_ab = cross_leakage(par, x, dx, y.pressure_a, y.pressure_b, held.viscosity)
    q_ea = outward_leakage(par, x, dx, y.pressure_a, held.viscosity)
    q_eb = outward_leakage(par, x, dx, y.pressure_b, held.viscosity)
    y.leakage_flow = q_ab
    y.outward_flow = q_ea + q_eb
    y.leakage_loss = (
        q_ab * (y.pressure_a - y.pressure_b)
        + q_ea * (y.pressure_a - ATMOSPHERE) + q_eb * (y.pressure_b - ATMOSPHERE)
    )  # fmt: skip
    return q_ab, q_ea, q_eb


def relieve(x: Any, dx: Any, par: Any, y: Any) -> tuple[float, float, float]:
    """Flow of the relief valves between the ports and from either one to the tank [m³/s]."""
    q_r = cross_relief(par, x, dx, y.pressure_a, y.pressure_b)
    q_ta = port_relief(par, x, dx, y.pressure_a, y.tank_pressure)
    q_tb = port_relief(par, x, dx, y.pressure_b, y.tank_pressure)
    y.cross_relief_flow = q_r
    y.port_relief_flow = q_ta + q_tb
    y.tank_flow += y.port_relief_flow
    y.relief_loss = (
        q_r * (y.pressure_a - y.pressure_b)
        + q_ta * (y.pressure_a - y.tank_pressure) + q_tb * (y.pressure_b - y.tank_pressure)
    )  # fmt: skip
    return q_r, q_ta, q_tb


def fill_chambers(x: Any, dx: Any, par: Any, held: Any, y: Any, p_a: float, p_b: float) -> None:
    """Continuity in both chambers (S1 eq. 3.11-3.14), at the pressures of their states [Pa].

    A piston in its stop, or beyond one that is off, leaves a chamber its dead volume.
    """
    left_a = max(0.0, x.position)
    left_b = max(0.0, par.cylinder_stroke - x.position)
    area_a = port_area(par, x, dx, par.cylinder_piston_area, left_a)
    area_b = port_area(par, x, dx, par.cylinder_area_ratio * par.cylinder_piston_area, left_b)
    v_a = par.cylinder_dead_volume_a + area_a * left_a
    v_b = par.cylinder_dead_volume_b + area_b * left_b
    y.volume_a, y.volume_b = v_a, v_b
    per_volumes = 1.0 / (v_a * v_b)  # one quotient for both chambers
    q_ab, q_ea, q_eb = leak(x, dx, par, held, y)
    q_r, q_ta, q_tb = relieve(x, dx, par, y)
    q_ca = cushion_flow_a(par, x, dx, left_a, held.viscosity)
    q_cb = cushion_flow_b(par, x, dx, left_b, held.viscosity)
    change_a, expansion_a, change_b, expansion_b = follow_gas(par, held, p_a, p_b)
    modulus, temperature = par.oil_bulk_modulus, held.temperature
    beta_a = oil(par, x, dx, modulus, p_a, v_a, temperature, change_a, expansion_a)
    beta_b = oil(par, x, dx, modulus, p_b, v_b, temperature, change_b, expansion_b)
    y.bulk_modulus_a, y.bulk_modulus_b = beta_a, beta_b
    # what is known last is added last, here and below
    into_a = y.flow_a - (q_ab + q_ea + area_a * x.velocity + q_r + q_ta - q_ca)
    into_b = q_ab - q_eb + area_b * x.velocity + q_r - q_tb + q_cb - y.flow_b
    y.pressure_rate_a = beta_a * (v_b * per_volumes) * into_a
    y.pressure_rate_b = beta_b * (v_a * per_volumes) * into_b
    cushion_rates(
        par, x, dx, left_a, left_b, x.velocity, y.pressure_rate_a, y.pressure_rate_b, beta_a,
        beta_b, held.viscosity,
    )  # fmt: skip
    y.cushion_pressure_a = cushion_a(par, x, dx, y.pressure_a)
    y.cushion_pressure_b = cushion_b(par, x, dx, y.pressure_b)
    y.relief_loss += q_ca * (y.cushion_pressure_a - y.pressure_a)
    y.relief_loss += q_cb * (y.cushion_pressure_b - y.pressure_b)
    gained_a = gas_factor(p_a, x.pressure_a, held.per_gas_pressure)
    gained_b = gas_factor(p_b, x.pressure_b, held.per_gas_pressure)
    dx.pressure_a = beta_a * (v_b * per_volumes) * gained_a * into_a
    dx.pressure_b = beta_b * (v_a * per_volumes) * gained_b * into_b


def feed(x: Any, dx: Any, par: Any, held: Any, y: Any, drawn: float, returned: float) -> None:
    """Continuity at the pump, the rates of the lines, and what warms the oil.

    What the valves on them draw and return [m³/s] is that of all actuators on one supply.
    """
    p_pump = y.pump_pressure
    line_rates(par, x, dx, p_pump, drawn, held.viscosity)
    return_rates(par, x, dx, returned)
    leaving = line_flow(par, x, dx, drawn)
    leakage = pump_loss(par, x, dx, p_pump, held.viscosity)
    if source_acts(par):
        y.pump_flow = source(par, x, dx, p_pump)
        y.relief_flow = relief(par, x, dx, p_pump)
        compliance = par.supply_volume / par.oil_bulk_modulus + capacity(par, x, dx, p_pump)
        # the check valve at the outlet closes where the pump leaks all that it displaces
        leakage = min(leakage, y.pump_flow)
        dx.pump_pressure = (y.pump_flow - leakage - y.relief_flow - leaving) / compliance
    else:
        y.pump_flow = leaving + leakage
        y.relief_flow = 0.0
    y.pump_leakage_flow = leakage
    y.pump_friction_loss = pump_drag(par, x, dx, p_pump, full_flow(par, x, dx), held.viscosity)
    y.return_flow = returned + y.relief_flow + leakage
    lost = y.valve_loss + y.leakage_loss + y.relief_loss
    heat(par, x, dx, lost + (leakage + y.relief_flow) * p_pump + y.pump_friction_loss)


def account(x: Any, par: Any, held: Any, y: Any) -> None:
    """Power and efficiency (S1 3.2)."""
    y.pump_power = y.pump_pressure * y.pump_flow
    y.shaft_power = y.pump_power + y.pump_friction_loss
    y.shaft_torque = y.shaft_power / par.supply_pump_speed
    y.supply_power = y.supply_pressure * y.supply_flow
    y.load_power = y.load_force * y.load_velocity
    y.line_loss = (
        y.port_pressure_a * y.port_flow_a - y.pressure_a * y.flow_a
        + y.pressure_b * y.flow_b - y.port_pressure_b * y.port_flow_b
    )  # fmt: skip
    y.friction_loss = y.friction_force * y.velocity
    y.efficiency = 0.0
    if y.load_power > 0.0 and y.shaft_power > y.load_power:
        y.efficiency = y.load_power / y.shaft_power
    y.oil_temperature = temperature(par, x, held, par.oil_temperature)
    y.viscosity = par.oil_kinematic_viscosity * held.viscosity
    y.gas_pressure = held.gas_pressure
    y.transverse_force = held.transverse_force


BALANCES = (
    transition, chamber_pressure, *GAS, hold, gas_factor, ports, *PORTS, move_spool,
    edge_flow, open_edges, meter, leak, relieve, fill_chambers, *MECHANICS, move, feed, account,
)  # fmt: skip
"""What `kernel` compiles, in the order of use."""
