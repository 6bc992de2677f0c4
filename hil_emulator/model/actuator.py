"""The balances of a valve-controlled asymmetric cylinder (S1 3.4, 3.6-3.19).

Sign convention of the whole project (S1): x = 0 at the cap end, extension positive;
chamber a on the cap side, b on the rod side; q_a > 0 into a; q_b > 0 *out of* b; a positive spool
position connects s-a and b-t; f > 0 pushes the load. Pressures are absolute.

`kernel` compiles the functions of this file together with the effects of each stage; a stage is
called here by its name. In every function:

    par   parameters, constant
    held  inputs and values derived from parameters, constant during a call of the integrator
    x     state
    dx    its rates, filled
    y     signals, filled from top to bottom: earlier ones may be read later
"""

from typing import Any

from hil_emulator.model.chambers import CHAMBERS, chamber_pressure, fill_chambers
from hil_emulator.model.gas import GAS, hold_gas
from hil_emulator.model.mechanics import MECHANICS, move_rod
from hil_emulator.model.ports import PORTS, deliver, fill_lines, port_pressures
from hil_emulator.model.quantities import HELD, INPUTS, PARAMS, SIGNALS, STATES
from hil_emulator.model.servo_valve import SERVO_VALVE, move_spool, orifice_flows, transition
from hil_emulator.model.stages import (
    capacity,
    full_flow,
    gas_pressure,
    heat,
    line_flow,
    line_rates,
    pump_drag,
    pump_loss,
    relief,
    return_rates,
    source,
    source_acts,
    supply,
    tank,
    temperature,
    vapour,
    viscosity,
)

__all__ = ["BALANCES", "HELD", "INPUTS", "PARAMS", "SIGNALS", "STATES"]


def prepare_step(x: Any, par: Any, inputs: Any, held: Any) -> None:
    """Fill the values that are constant during a call of the integrator."""
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


def ports(x: Any, dx: Any, par: Any, held: Any, y: Any) -> tuple[float, float]:
    """Set all pressures, from the states alone; return those of the chambers' states [Pa]."""
    p_pump = max(0.0, par.supply_pressure + x.pump_pressure)
    y.pump_pressure = p_pump
    y.supply_pressure = supply(par, x, dx, p_pump)
    y.tank_pressure = tank(par, x, dx, par.tank_pressure)
    p_a = chamber_pressure(x.pressure_a, held.gas_pressure)
    p_b = chamber_pressure(x.pressure_b, held.gas_pressure)
    y.pressure_a = vapour(par, x, dx, p_a, x.pressure_a)
    y.pressure_b = vapour(par, x, dx, p_b, x.pressure_b)
    return p_a, p_b


def move(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Evaluate the balances of valve, cylinder and load at one state, and the signals they need."""
    p_a, p_b = ports(x, dx, par, held, y)
    port_pressures(x, dx, par, y)
    move_spool(x, dx, par, held, y)
    orifice_flows(x, dx, par, held, y)
    deliver(x, dx, par, y)
    fill_chambers(x, dx, par, held, y, p_a, p_b)
    fill_lines(x, dx, par, held, y)
    move_rod(x, dx, par, held, y)


def supply_balance(
    x: Any, dx: Any, par: Any, held: Any, y: Any, drawn: float, returned: float
) -> None:
    """Continuity at the pump, the rates of the lines, and the heat of the oil.

    The flows [m³/s] from and to the lines are those of all actuators on one supply.
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
        # the check valve at the outlet closes if the pump leaks all of its flow
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


def power_signals(x: Any, par: Any, held: Any, y: Any) -> None:
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
    *GAS, *CHAMBERS, *PORTS, *SERVO_VALVE, *MECHANICS, prepare_step, ports, move,
    supply_balance, power_signals,
)  # fmt: skip
"""What `kernel` compiles, in the order of use."""
