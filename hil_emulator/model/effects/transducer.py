"""From the physical quantity to what a sensor reports: the one chain all channels share.

These laws run once per tick. A `span` unit means the unit of the channel; their typical values
and bounds are fractions of the channel's span.
"""

import math

from hil_emulator.model.declare import Param, Quantity, effect
from hil_emulator.model.stages import transducer

_INF = math.inf


@effect(
    transducer,
    knob=Param("relative", "1", "relative error of the gain", 0.01, -0.5, 0.5, shown="%"),
    source="sensor data sheets (sensitivity tolerance)",
    signature="proportional to the channel itself",
)
def gain_error(reading: float, relative: float) -> float:
    """y = (1 + g) x."""
    return reading * (1.0 + relative)


@effect(
    transducer,
    knob=Param("value", "span", "reading at zero", 0.005, -0.5, 0.5),
    source="sensor data sheets (zero balance)",
    signature="constant part of the channel",
)
def offset(reading: float, value: float) -> float:
    """y = x + o."""
    return reading + value


@effect(
    transducer,
    knob=Param("time_constant", "s", "time constant of the amplifier", 5e-4, 0.0, 1.0, shown="ms"),
    states=(Quantity("memory", "span", "output of the low-pass"),),
    source="first-order low-pass, exact for an input held during the tick",
    signature="the channel trails its quantity",
)
def lag(reading: float, period: float, time_constant: float, memory: float) -> tuple[float, float]:
    """y = y + (1 - exp(-T/tau)) (x - y)."""
    if math.isnan(memory):
        return reading, reading
    filtered = memory + (1.0 - math.exp(-period / time_constant)) * (reading - memory)
    return filtered, filtered


@effect(
    transducer,
    knob=Param("sigma", "span", "standard deviation", 0.001, 0.0, 0.1),
    source="S1 3.4.3 for the load cell; sensor data sheets",
    signature="white, in the channel alone",
    not_modelled="its correlation in time",
)
def noise(reading: float, normal: float, sigma: float) -> float:
    """y = x + sigma n, n normally distributed."""
    return reading + sigma * normal


@effect(
    transducer,
    knob=Param("step", "span", "least significant bit", 2.4e-4, 0.0, 0.1),
    source="12-bit converter of a public bench: 1/4096 of the span",
    signature="steps in the channel",
)
def resolution(reading: float, step: float) -> float:
    """y = q round(x/q)."""
    return step * math.floor(reading / step + 0.5)


@effect(
    transducer,
    knob=Param("upper", "span", "largest reading", 1.0, -_INF, _INF),
    off=_INF,
    shape=(Param("lower", "span", "smallest reading", 0.0, -_INF, _INF, default=-_INF),),
    source="measuring range of the transducer",
    signature="flat tops in the channel",
)
def measuring_range(reading: float, upper: float, lower: float) -> float:
    """y = max(lower, min(upper, x))."""
    return max(lower, min(upper, reading))


EFFECTS = (gain_error, offset, lag, noise, resolution, measuring_range)
