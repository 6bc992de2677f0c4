"""The balances of a valve-controlled asymmetric cylinder (S1 3.4, 3.6-3.19) and their integration.

Sign convention, said once for the whole project (S1): x = 0 at the cap end, extension positive;
chamber a on the cap side, b on the rod side; q_a > 0 into a; q_b > 0 *out of* b; a positive spool
position connects s-a and b-t; f > 0 pushes the load. Pressures are absolute.

`kernel` compiles the functions of this file together with the effects of each stage; a stage is
called here by its name.
"""

import math
from typing import Any

from hil_emulator.model.declare import Param, Quantity
from hil_emulator.model.stages import (
    command,
    cross_leakage,
    friction,
    inertia,
    load,
    metering,
    oil,
    outward_leakage,
    spool,
    stop,
)

PARAMS: dict[str, tuple[Param, ...]] = {
    "supply": (
        Param("pressure", "Pa", "supply pressure, absolute", 160e5, 1e5, 400e5, "bar",
              source="public HyQ bench scripts"),
    ),
    "tank": (
        Param("pressure", "Pa", "return pressure, absolute", 1e5, 0.0, 50e5, "bar", default=1e5,
              source="public HyQ bench script: 1 bar"),
    ),
    "valve": (
        Param("gain", "m^3/(s*A*Pa^0.5)", "valve gain K_v (S1 eq. 3.8)", 6.68e-6, 1e-8, 1e-3,
              source="7.5 l/min at 10 mA over 70 bar, the whole valve"),
        Param("natural_frequency", "Hz", "natural frequency of the spool", 250.0, 1.0, 1000.0,
              source="S1 3.3.1"),
        Param("damping_ratio", "1", "damping ratio of the spool", 0.7, 0.1, 3.0, default=0.7,
              source="0.5 to 0.9 in public HyQ scripts; 0.7 puts -3 dB at the natural frequency"),
        Param("laminar_width", "Pa", "pressure difference below which an edge is laminar",
              1e5, 1e3, 20e5, "bar", default=1e5),
    ),
    "cylinder": (
        Param("piston_area", "m^2", "cap-side area A_p", 2.0106e-4, 1e-6, 1.0, "cm^2",
              source="bore 16 mm"),
        Param("area_ratio", "1", "annulus area over piston area (alpha)", 0.61, 0.05, 1.0,
              source="S1 3.4"),
        Param("stroke", "m", "stroke L_c", 0.08, 1e-3, 10.0, "mm",
              source="Hoerbiger LB6 1610 0080"),
        Param("dead_volume_a", "m^3", "volume of chamber a and its line at x = 0",
              3e-6, 1e-8, 1e-1, "ml"),
        Param("dead_volume_b", "m^3", "volume of chamber b and its line at x = L_c",
              3e-6, 1e-8, 1e-1, "ml"),
    ),
    "oil": (
        Param("bulk_modulus", "Pa", "bulk modulus of the oil without free air", 1.3e9, 1e8, 3e9,
              "MPa", source="S1 3.1.1"),
    ),
    "load": (
        Param("mass", "kg", "mass M_l moved by the rod", 50.0, 0.1, 1e5, source="S1 Fig. 3.14"),
    ),
    "initial": (
        Param("position", "m", "position at the start", 0.04, 0.0, 10.0, "mm", default=0.04),
    ),
}  # fmt: skip
"""Parameters that every actuator has, by configuration table."""

STATES = (
    Quantity("spool_position", "A", "spool position u_v as the current that holds it there"),
    Quantity("spool_speed", "A/s", "its rate of change"),
    Quantity("pressure_a", "Pa", "pressure in the cap-side chamber"),
    Quantity("pressure_b", "Pa", "pressure in the rod-side chamber"),
    Quantity("position", "m", "position of the rod"),
    Quantity("velocity", "m/s", "velocity of the rod"),
)

INPUTS = (
    Quantity("valve_current", "A", "set point of the coil current"),
    Quantity("external_force", "N", "further force against the load"),
)

SIGNALS = (
    *STATES,
    Quantity("valve_current", "A", "current that drives the spool"),
    Quantity("supply_pressure", "Pa", "pressure at the valve's port s"),
    Quantity("tank_pressure", "Pa", "pressure at the valve's port t"),
    Quantity("flow_a", "m^3/s", "flow q_a into chamber a"),
    Quantity("flow_b", "m^3/s", "flow q_b out of chamber b"),
    Quantity("supply_flow", "m^3/s", "flow out of the supply"),
    Quantity("tank_flow", "m^3/s", "flow into the tank"),
    Quantity("leakage_flow", "m^3/s", "flow past the piston from a to b"),
    Quantity("bulk_modulus_a", "Pa", "effective bulk modulus in chamber a"),
    Quantity("bulk_modulus_b", "Pa", "effective bulk modulus in chamber b"),
    Quantity("volume_a", "m^3", "volume of chamber a"),
    Quantity("volume_b", "m^3", "volume of chamber b"),
    Quantity("pressure_rate_a", "Pa/s", "rate of change of pressure a"),
    Quantity("pressure_rate_b", "Pa/s", "rate of change of pressure b"),
    Quantity("acceleration", "m/s^2", "acceleration of the rod"),
    Quantity("hydraulic_force", "N", "f_h = A_p (p_a - alpha p_b)"),
    Quantity("friction_force", "N", "f_f, against the motion"),
    Quantity("stop_force", "N", "force of the cylinder's ends on the rod"),
    Quantity("load_force", "N", "f, what rod and load exchange"),
    Quantity("resisting_force", "N", "force of the surroundings against the load"),
    Quantity("valve_loss", "W", "power turned into heat at the metering edges"),
    Quantity("leakage_loss", "W", "power lost through leakage"),
)


def pressure_root(difference: float, width: float) -> float:
    """Return a square root of a pressure difference that is smooth and odd through zero [Pa^½].

    phi(dp) = dp / (dp² + delta²)^¼ tends to sign(dp) sqrt(|dp|) far from zero and to the line
    dp / sqrt(delta) near it, where an orifice is laminar. At |dp| = 10 delta it is 0.25 % low.
    """
    return difference / math.sqrt(math.sqrt(difference * difference + width * width))


def derivative(x: Any, dx: Any, par: Any, inputs: Any, y: Any) -> None:
    """Evaluate every balance at one state: fills the rates `dx` and the signals `y`."""
    p_a = x.pressure_a
    p_b = x.pressure_b
    position = x.position
    velocity = x.velocity
    p_s = par.supply_pressure
    p_t = par.tank_pressure

    # valve: a second-order spool, unity gain (S1 eq. 3.4)
    current = command(par, x, dx, inputs.valve_current)
    w = 2.0 * math.pi * par.valve_natural_frequency
    u_v = x.spool_position
    speed = x.spool_speed
    dx.spool_position = spool(par, x, dx, speed)
    dx.spool_speed = w * w * (current - u_v) - 2.0 * par.valve_damping_ratio * w * speed

    # four metering edges (S1 eq. 3.9, 3.10, with flow in both directions through each)
    opens = max(0.0, metering(par, x, dx, u_v, u_v))
    closes = max(0.0, metering(par, x, dx, -u_v, u_v))
    width = par.valve_laminar_width
    gain = par.valve_gain
    q_sa = gain * opens * pressure_root(p_s - p_a, width)
    q_bt = gain * opens * pressure_root(p_b - p_t, width)
    q_sb = gain * closes * pressure_root(p_s - p_b, width)
    q_at = gain * closes * pressure_root(p_a - p_t, width)
    q_a = q_sa - q_at
    q_b = q_bt - q_sb

    # chambers (S1 eq. 3.11-3.14)
    area_a = par.cylinder_piston_area
    area_b = par.cylinder_area_ratio * area_a
    v_a = par.cylinder_dead_volume_a + area_a * position
    v_b = par.cylinder_dead_volume_b + area_b * (par.cylinder_stroke - position)
    q_ab = cross_leakage(par, x, dx, p_a, p_b)
    q_ea = outward_leakage(par, x, dx, p_a)
    q_eb = outward_leakage(par, x, dx, p_b)
    beta_a = oil(par, x, dx, par.oil_bulk_modulus, p_a)
    beta_b = oil(par, x, dx, par.oil_bulk_modulus, p_b)
    dp_a = beta_a / v_a * (q_a - q_ab - q_ea - area_a * velocity)
    dp_b = beta_b / v_b * (q_ab - q_b - q_eb + area_b * velocity)
    dx.pressure_a = dp_a
    dx.pressure_b = dp_b

    # forces (S1 eq. 3.15-3.19)
    f_h = area_a * p_a - area_b * p_b
    f_f = friction(par, x, dx, velocity, position, p_a, p_b)
    f_stop = stop(par, x, dx, position, velocity)
    f_load = load(par, x, dx, position, velocity) + inputs.external_force
    m_rod = inertia(par, x, dx, position)
    acceleration = (f_h - f_f + f_stop - f_load) / (par.load_mass + m_rod)
    dx.position = velocity
    dx.velocity = acceleration

    y.spool_position = u_v
    y.spool_speed = speed
    y.pressure_a = p_a
    y.pressure_b = p_b
    y.position = position
    y.velocity = velocity
    y.valve_current = current
    y.supply_pressure = p_s
    y.tank_pressure = p_t
    y.flow_a = q_a
    y.flow_b = q_b
    y.supply_flow = q_sa + q_sb
    y.tank_flow = q_at + q_bt
    y.leakage_flow = q_ab
    y.bulk_modulus_a = beta_a
    y.bulk_modulus_b = beta_b
    y.volume_a = v_a
    y.volume_b = v_b
    y.pressure_rate_a = dp_a
    y.pressure_rate_b = dp_b
    y.acceleration = acceleration
    y.hydraulic_force = f_h
    y.friction_force = f_f
    y.stop_force = f_stop
    y.load_force = f_h - f_f + f_stop - m_rod * acceleration
    y.resisting_force = f_load
    y.valve_loss = q_sa * (p_s - p_a) + q_bt * (p_b - p_t) + q_sb * (p_s - p_b) + q_at * (p_a - p_t)
    y.leakage_loss = q_ab * (p_a - p_b) + q_ea * p_a + q_eb * p_b


def integrate(
    rows: Any, memory: Any, par: Any, inputs: Any, y: Any, step: float, steps: int
) -> None:
    """Take `steps` steps of classical Runge-Kutta with the inputs held.

    Args:
        rows: six state records: the state, a trial state, four rates.
        memory: the same memory as float64, shape (6 * states,).
        par: parameters.
        inputs: commands and disturbances, constant over the call.
        y: signals; they belong to the state reached.
        step: step width [s].
        steps: number of steps.

    """
    n = len(memory) // 6
    for _ in range(steps):
        derivative(rows[0], rows[2], par, inputs, y)
        for i in range(n):
            memory[n + i] = memory[i] + 0.5 * step * memory[2 * n + i]
        derivative(rows[1], rows[3], par, inputs, y)
        for i in range(n):
            memory[n + i] = memory[i] + 0.5 * step * memory[3 * n + i]
        derivative(rows[1], rows[4], par, inputs, y)
        for i in range(n):
            memory[n + i] = memory[i] + step * memory[4 * n + i]
        derivative(rows[1], rows[5], par, inputs, y)
        for i in range(n):
            slope = memory[2 * n + i] + 2.0 * (memory[3 * n + i] + memory[4 * n + i])
            memory[i] += step / 6.0 * (slope + memory[5 * n + i])
    # the signals of a trial state are not those of the state reached
    derivative(rows[0], rows[2], par, inputs, y)


BALANCES = (pressure_root, derivative, integrate)
"""What `kernel` compiles, in the order of use."""
