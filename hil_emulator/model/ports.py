"""Lines between the valve's ports and the chambers, and load-holding valves.

    port of the valve --- line --- block --- holding valves --- chamber

Without these parts all pressures and flows are those of the chamber. Signs and the arguments of
every function as in `actuator`. A pressure between valve and chamber is stored relative to the
chamber's *state*, so that zero is rest at any pressure.
"""

import math
from typing import Any

from hil_emulator.model.stages import (
    cylinder_line_rates,
    holding,
    holding_acts,
    holding_rates,
    line_a,
    line_b,
    line_flow_a,
    line_flow_b,
)


def port_pressures(x: Any, dx: Any, par: Any, y: Any) -> None:
    """Set the pressures between valve and chambers, from the states alone."""
    y.block_pressure_a = y.pressure_a
    y.block_pressure_b = y.pressure_b
    if holding_acts(par):
        y.block_pressure_a = max(0.0, x.pressure_a + x.block_excess_a)
        y.block_pressure_b = max(0.0, x.pressure_b + x.block_excess_b)
    y.port_pressure_a = line_a(par, x, dx, y.block_pressure_a, x.pressure_a)
    y.port_pressure_b = line_b(par, x, dx, y.block_pressure_b, x.pressure_b)


def passage_flow(drop: float, gain: float, width: float) -> float:
    """Flow through a laminar and a turbulent resistance in series [m³/s].

    dp = q²/K² + 2 √w q/K, solved for q: both losses are equal at dp = 8 w.
    """
    flow = gain * (math.sqrt(abs(drop) + width) - math.sqrt(width))
    return math.copysign(flow, drop)


def deliver(x: Any, dx: Any, par: Any, y: Any) -> None:
    """Set the flows into chamber a and out of chamber b."""
    y.flow_a = line_flow_a(par, x, dx, y.port_flow_a)
    y.flow_b = line_flow_b(par, x, dx, y.port_flow_b)
    if holding_acts(par):
        modulus = par.oil_bulk_modulus / par.lines_block_volume
        # the rates of the blocks; `fill_lines` subtracts those of the chambers
        dx.block_excess_a = modulus * y.flow_a
        dx.block_excess_b = -modulus * y.flow_b
        gain = par.lines_passage_gain
        width = par.lines_laminar_width
        open_a = holding(par, x, dx, 1.0, 1.0)
        open_b = holding(par, x, dx, 1.0, -1.0)
        y.flow_a = open_a * passage_flow(y.block_pressure_a - y.pressure_a, gain, width)
        y.flow_b = open_b * passage_flow(y.pressure_b - y.block_pressure_b, gain, width)
        dx.block_excess_a -= modulus * y.flow_a
        dx.block_excess_b += modulus * y.flow_b


def fill_lines(x: Any, dx: Any, par: Any, held: Any, y: Any) -> None:
    """Set the rates between valve and chambers from those of the chambers."""
    p_a = y.block_pressure_a
    p_b = y.block_pressure_b
    if holding_acts(par):
        dx.block_excess_a -= dx.pressure_a
        dx.block_excess_b -= dx.pressure_b
        holding_rates(par, x, dx, p_a, p_b, y.pressure_a, y.pressure_b)
    cylinder_line_rates(
        par, x, dx, y.port_pressure_a, y.port_pressure_b, p_a, p_b, y.port_flow_a, y.port_flow_b,
        x.pressure_a, x.pressure_b, dx.pressure_a, dx.pressure_b, held.viscosity,
    )  # fmt: skip


PORTS = (port_pressures, passage_flow, deliver, fill_lines)
"""What `kernel` compiles of this file, in the order of use."""
