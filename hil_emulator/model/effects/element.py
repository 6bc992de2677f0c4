"""The sensing element of a channel: low-pass filters that follow the quantity itself.

They run once per step of the integrator, so that motion between two ticks is filtered before it is
sampled. Each filter is exact for a quantity that is linear within a step, with any time constant: a
ramp is delayed by the filter's delay, and no filter needs a smaller step.
"""

import math

from hil_emulator.model.declare import Param, Quantity, effect
from hil_emulator.model.stages import element

_BEFORE = Quantity("before", "span", "quantity at the end of the last interval")
_OUTPUT = Quantity("output", "span", "output of the low-pass")


@effect(
    element,
    knob=Param("time_constant", "s", "time constant of the low-pass", 5e-4, 0.0, 60.0, shown="ms"),
    states=(_BEFORE, _OUTPUT),
    source="first order: 0.1 to 2 ms in pressure ports and amplifiers, seconds in flow meters; "
    "assumed",
    signature="the channel lags its quantity",
    not_modelled="for an estimator of velocity the positions lag, not the velocity",
)
def lag(
    quantity: float, interval: float, time_constant: float, before: float, output: float
) -> tuple[float, float, float]:
    """tau dy/dt = x - y.

    The sensor lags behind.
    """
    if math.isnan(output):
        return quantity, quantity, quantity
    behind = time_constant * (quantity - before) / interval
    kept = math.exp(-interval / time_constant)
    after = quantity - behind + kept * (output - before + behind)
    return after, quantity, after


@effect(
    element,
    knob=Param("cut_off", "Hz", "frequency at which 3 dB are lost", 200.0, 0.1, math.inf,
               off=math.inf),
    states=(_BEFORE, _OUTPUT, Quantity("slope", "span/s", "rate of change of the output")),
    source="Butterworth low-pass of second order ahead of a converter; cut-off assumed",
    signature="the channel lags, and fast motion is missing from it",
    not_modelled="for an estimator of velocity the positions are filtered, not the velocity",
)  # fmt: skip
def anti_aliasing(
    quantity: float, interval: float, cut_off: float, before: float, output: float, slope: float
) -> tuple[float, float, float, float]:
    """d²y/dt² = w² (x - y) - sqrt(2) w dy/dt,  w = 2 pi f_c.

    A filter removes fast motion from the reading.
    """
    if math.isnan(output):
        return quantity, quantity, quantity, 0.0
    # real and imaginary part of the poles have the same magnitude
    pole = math.sqrt(2.0) * math.pi * cut_off
    ramp = (quantity - before) / interval
    behind = ramp / pole
    off, speed = output - before + behind, slope - ramp
    angle = pole * interval
    kept, c, s = math.exp(-angle), math.cos(angle), math.sin(angle)
    after = quantity - behind + kept * ((c + s) * off + s * speed / pole)
    return after, quantity, after, ramp + kept * ((c - s) * speed - 2.0 * pole * s * off)


EFFECTS = (lag, anti_aliasing)
