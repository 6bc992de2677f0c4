"""The chambers of the cylinder: their flows and pressures.

Signs and the arguments of every function as in `actuator`.
"""

import math
from typing import Any

from hil_emulator.model.constants import ATMOSPHERE
from hil_emulator.model.gas import follow_gas
from hil_emulator.model.stages import (
    cross_leakage,
    cross_relief,
    cushion_a,
    cushion_b,
    cushion_flow_a,
    cushion_flow_b,
    cushion_rates,
    oil,
    outward_leakage,
    port_area,
    port_relief,
)


def chamber_pressure(state: float, gas: float) -> float:
    """Return the pressure that belongs to a chamber's state [Pa], never negative.

    s = p - g²/p: far above the gas pressure g the state is the pressure. Below, it continues to
    large negative values as gas expands. So p > 0 after a step of any width, and the volume of gas
    must be filled again before the pressure rises. Without gas the corner is sharp.
    """
    if gas == 0.0:
        return max(0.0, state)
    square = gas * gas
    root = math.sqrt(state * state + 4.0 * square)
    return 0.5 * (state + root) if state > 0.0 else 2.0 * square / (root - state)


def gas_factor(pressure: float, state: float, per_gas: float) -> float:
    """Return ds/dp of `chamber_pressure`, the rate of the state over that of the pressure.

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
    """Flow of the relief valves between the ports, and from each port to the tank [m³/s]."""
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

    At or beyond the end of the stroke the volume of a chamber is its dead volume.
    """
    left_a = max(0.0, x.position)
    left_b = max(0.0, par.cylinder_stroke - x.position)
    area_a = port_area(par, x, dx, par.cylinder_piston_area, left_a)
    area_b = port_area(par, x, dx, par.cylinder_area_ratio * par.cylinder_piston_area, left_b)
    v_a = par.cylinder_dead_volume_a + area_a * left_a
    v_b = par.cylinder_dead_volume_b + area_b * left_b
    y.volume_a, y.volume_b = v_a, v_b
    per_volumes = 1.0 / (v_a * v_b)  # one division for both chambers
    q_ab, q_ea, q_eb = leak(x, dx, par, held, y)
    q_r, q_ta, q_tb = relieve(x, dx, par, y)
    q_ca = cushion_flow_a(par, x, dx, left_a, held.viscosity)
    q_cb = cushion_flow_b(par, x, dx, left_b, held.viscosity)
    change_a, expansion_a, change_b, expansion_b = follow_gas(par, held, p_a, p_b)
    modulus, temperature = par.oil_bulk_modulus, held.temperature
    beta_a = oil(par, x, dx, modulus, p_a, v_a, temperature, change_a, expansion_a)
    beta_b = oil(par, x, dx, modulus, p_b, v_b, temperature, change_b, expansion_b)
    y.bulk_modulus_a, y.bulk_modulus_b = beta_a, beta_b
    # the value computed last is added last, here and below
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


CHAMBERS = (chamber_pressure, gas_factor, leak, relieve, fill_chambers)
"""What `kernel` compiles of this file, in the order of use."""
