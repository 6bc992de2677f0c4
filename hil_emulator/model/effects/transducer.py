"""From the physical quantity to the reading of a sensor: the common chain of all channels.

These laws run once per tick, on the output of the sensing element (`element`). The unit `span`
means the unit of the channel; its typical values and bounds are fractions of the channel's span.
"""

import math

from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.effects.history import HISTORY, Array, past
from hil_emulator.model.stages import transducer

_INF = math.inf


@effect(
    transducer,
    knob=Param("window", "s", "time over which differences of the position are averaged",
               0.01, 0.0, 0.1, shown="ms", source="S2: n_s = 1000 at 100 kHz"),
    states=(Quantity("history", "span", "positions read at the last ticks", length=HISTORY),),
    source="S2 eq. 9-10 with the factor 1/n_s that the printed eq. 10 misses; the mean of "
           "differences is one difference over the window",
    signature="channel velocity only: lags by half the window, steps with the resolution",
    not_modelled="windows longer than 127 ticks",
)  # fmt: skip
def velocity_estimator(differenced: float, period: float, window: float, history: Array) -> float:
    """v = (x(t) - x(t - n T)) / (n T).

    The velocity is formed from positions, and late.
    """
    return (differenced - past(history, differenced, window / period)) / window


@effect(
    transducer,
    knob=Param("relative", "1", "part of full scale at full scale of the neighbour",
               0.02, -0.2, 0.2, shown="%", source="load cells: some 2 % of a transverse force"),
    source="load-cell manuals (transverse force); multiplexed converters (channel before)",
    signature="the channel moves with another quantity",
)  # fmt: skip
def crosstalk(reading: float, neighbour: float, span: float, relative: float) -> float:
    """y = x + c s n, n = neighbour over its own span s_n.

    A neighbouring quantity acts on the sensor.
    """
    return reading + relative * span * neighbour


@effect(
    transducer,
    knob=Param("relative", "1", "deviation at one span, relative to the span", 0.005, -0.1, 0.1,
               shown="%"),
    source="sensor data sheets (non-linearity), as its leading odd term",
    signature="gain that grows with the channel itself",
    not_modelled="hysteresis of the sensor",
)  # fmt: skip
def nonlinearity(reading: float, span: float, relative: float) -> float:
    """y = x (1 + n |x|/s).

    The sensor's curve is bent.
    """
    return reading * (1.0 + relative * abs(reading) / span)


@effect(
    transducer,
    knob=Param("relative", "1", "half the relative difference of both slopes", 0.01, -0.2, 0.2,
               shown="%"),
    source="load cell amplifiers with different gains in tension and compression",
    signature="two slopes that meet at zero",
)  # fmt: skip
def slope_asymmetry(reading: float, relative: float) -> float:
    """y = x (1 + g sign(x)).

    The sensor's slope differs with the sign.
    """
    return reading * (1.0 + relative * math.copysign(1.0, reading))


@effect(
    transducer,
    knob=Param("relative", "1", "relative error of the gain", 0.01, -0.5, 0.5, shown="%"),
    source="sensor data sheets (sensitivity tolerance)",
    signature="proportional to the channel itself",
)
def gain_error(reading: float, relative: float) -> float:
    """y = (1 + g) x.

    The sensor's scale is off.
    """
    return reading * (1.0 + relative)


@effect(
    transducer,
    knob=Param("relative", "1", "final creep relative to a held load", 0.001, -0.05, 0.05,
               shown="%"),
    shape=(
        Param("time_constant", "s", "time constant of the creep", 60.0, 0.1, 1e5, default=60.0,
              spread=factor(2.0)),
    ),
    states=(Quantity("crept", "span", "reading after the creep's low-pass"),),
    source="load-cell data sheets (creep over 30 min), first order, exact for a held input",
    signature="slow approach after a step of the channel",
)  # fmt: skip
def creep(
    reading: float, period: float, crept: float, relative: float, time_constant: float
) -> tuple[float, float]:
    """y = x + c m,  tau dm/dt = x - m.

    The sensor creeps under load.
    """
    before = 0.0 if math.isnan(crept) else crept
    after = before - math.expm1(-period / time_constant) * (reading - before)
    return reading + relative * after, after


@effect(
    transducer,
    knob=Param("value", "span", "reading at zero", 0.005, -100.0, 100.0, difference=True),
    source="sensor data sheets (zero balance)",
    signature="constant part of the channel",
)
def offset(reading: float, value: float) -> float:
    """y = x + o.

    The sensor's zero is off.
    """
    return reading + value


@effect(
    transducer,
    knob=Param("rate", "1/s", "drift of the zero per second, relative to the span",
               1e-5, -0.01, 0.01),
    states=(Quantity("drifted", "1", "drift so far"),),
    source="sensor data sheets (zero drift while warming up), linear in time",
    signature="constant part of the channel that grows slowly",
    not_modelled="return of the zero with temperature",
)  # fmt: skip
def zero_drift(
    reading: float, span: float, period: float, drifted: float, rate: float
) -> tuple[float, float]:
    """y = x + s d t, from the first sample on.

    The sensor's zero drifts.
    """
    now = 0.0 if math.isnan(drifted) else drifted + rate * period
    return reading + span * now, now


@effect(
    transducer,
    knob=Param("time", "s", "age of the reading", 1e-3, 0.0, 0.1, shown="ms"),
    states=(Quantity("history", "span", "readings of the last ticks", length=HISTORY),),
    source="conversion and digital filtering: dead time, linear between ticks",
    signature="phase of the channel, proportional to frequency",
    not_modelled="readings older than 127 ticks",
)
def delay(reading: float, period: float, time: float, history: Array) -> float:
    """y(t) = x(t - T_d).

    The reading is late.
    """
    return past(history, reading, time / period)


@effect(
    transducer,
    knob=Param("amplitude", "span", "amplitude", 0.001, 0.0, 100.0, difference=True),
    shape=(
        Param(
            "frequency",
            "Hz",
            "mains frequency",
            50.0,
            1.0,
            1000.0,
            default=50.0,
            spread=factor(1.2),
        ),
    ),
    states=(Quantity("turns", "1", "periods of the mains so far"),),
    source="induction from the mains",
    signature="one line in the spectrum, folded where it lies above half the tick rate",
)
def hum(
    reading: float, period: float, turns: float, amplitude: float, frequency: float
) -> tuple[float, float]:
    """y = x + a sin(2 pi f t).

    The mains hum in the reading.
    """
    now = 0.0 if math.isnan(turns) else (turns + frequency * period) % 1.0
    return reading + amplitude * math.sin(2.0 * math.pi * now), now


@effect(
    transducer,
    knob=Param("sigma", "span", "standard deviation", 0.001, 0.0, 100.0, difference=True),
    source="S1 3.4.3 for the load cell; sensor data sheets",
    signature="white, only in this channel",
    not_modelled="its correlation in time",
)
def noise(reading: float, normal: float, sigma: float) -> float:
    """y = x + sigma n, n normally distributed.

    The reading is noisy.
    """
    return reading + sigma * normal


@effect(
    transducer,
    knob=Param("step", "span", "least significant bit", 2.4e-4, 0.0, 100.0, difference=True),
    source="12-bit converter of a public bench: 1/4096 of the span",
    signature="steps in the channel",
)
def resolution(reading: float, step: float) -> float:
    """y = q round(x/q).

    The reading goes in steps.
    """
    return step * math.floor(reading / step + 0.5)


@effect(
    transducer,
    knob=Param("upper", "span", "largest reading", 1.0, -_INF, _INF, off=_INF),
    shape=(
        Param("lower", "span", "smallest reading", 0.0, -_INF, _INF, default=-_INF, spread=SETTING),
    ),
    source="measuring range of the transducer",
    signature="flat tops in the channel",
)
def measuring_range(reading: float, upper: float, lower: float) -> float:
    """y = max(lower, min(upper, x)).

    The sensor saturates.
    """
    return max(lower, min(upper, reading))


EFFECTS = (
    velocity_estimator, crosstalk, nonlinearity, slope_asymmetry, gain_error, creep, offset,
    zero_drift, delay, hum, noise, resolution, measuring_range,
)  # fmt: skip
