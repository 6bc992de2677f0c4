"""Expansion of the gas in both chambers, without a power function in every balance.

The power is computed at the pressures at which a call of the integrator begins; the pressures
during the call are usually near these. Larger changes are computed in strides, because a library
call during a step would spill the registers.

Signs and the arguments of every function as in `actuator`.
"""

import math
from typing import Any

from hil_emulator.model.constants import (
    ATMOSPHERE,
    GAS_REACH,
    GAS_STRIDE,
    LEAST_GAS_PRESSURE,
)
from hil_emulator.model.stages import gas_expansion, gas_expansion_acts


def hold_gas(x: Any, par: Any, held: Any, p_a: float, p_b: float) -> None:
    """Store pressures [Pa] and gas volumes at the beginning of a call of the integrator."""
    start_a, start_b = max(LEAST_GAS_PRESSURE, p_a), max(LEAST_GAS_PRESSURE, p_b)
    held.start_pressure_a, held.per_start_pressure_a = start_a, 1.0 / start_a
    held.start_pressure_b, held.per_start_pressure_b = start_b, 1.0 / start_b
    held.gas_expansion_a = gas_expansion(par, x, held, start_a)
    held.gas_expansion_b = gas_expansion(par, x, held, start_b)
    held.gas_stride = gas_expansion(par, x, held, GAS_STRIDE * ATMOSPHERE)


def approach(ratio: float, expansion: float, stride: float) -> tuple[float, float]:
    """Change the pressure of the gas in strides until the remaining change is small.

    Args:
        ratio: final pressure over initial pressure.
        expansion: volume of the gas at the initial pressure over that at 1 atm.
        stride: factor on the volume for a pressure higher by `GAS_STRIDE`.

    Returns:
        The remaining relative change of pressure, and the expansion before it.

    """
    while 1.0 + GAS_REACH < ratio < math.inf:
        ratio *= 1.0 / GAS_STRIDE
        expansion *= stride
    while 0.0 < ratio < 1.0 - GAS_REACH:
        ratio *= GAS_STRIDE
        expansion *= 1.0 / stride
    return ratio - 1.0, expansion


def follow_gas(par: Any, held: Any, p_a: float, p_b: float) -> tuple[float, float, float, float]:
    """Return the results of `approach` for the pressures [Pa] of chamber a, then of b.

    A common branch for both chambers, so that both are computed in the time of one.
    """
    change_a = (p_a - held.start_pressure_a) * held.per_start_pressure_a
    change_b = (p_b - held.start_pressure_b) * held.per_start_pressure_b
    expansion_a, expansion_b = held.gas_expansion_a, held.gas_expansion_b
    if gas_expansion_acts(par) and max(abs(change_a), abs(change_b)) > GAS_REACH:
        ratio_a, ratio_b = p_a * held.per_start_pressure_a, p_b * held.per_start_pressure_b
        change_a, expansion_a = approach(ratio_a, expansion_a, held.gas_stride)
        change_b, expansion_b = approach(ratio_b, expansion_b, held.gas_stride)
    return change_a, expansion_a, change_b, expansion_b


GAS = (hold_gas, approach, follow_gas)
"""What `kernel` compiles of this file, in the order of use."""
