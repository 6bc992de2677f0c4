"""The servo valve between the set point and its spool.

The spool position is expressed in ampere: the current that holds the spool there (S1 eq. 3.4).
"""

import math

from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.effects.history import HISTORY, Array, remember, sample_of
from hil_emulator.model.stages import (
    arrival,
    command,
    early_set_point,
    late_set_point,
    pilot,
    spool,
    spool_force,
    spool_reach,
)

_FLUX_RATE = 5e3
"""Rate at which the flux follows the coil's current [1/s] (assumed: eddy currents of 0.2 ms). Its
product with a step of `identify` is below 1.29. Above, the slopes within one classical Runge-Kutta
step have both signs, and the loop, which integrates |di/dt|, loses half its width."""

_FASTEST = 2.0
"""Largest rate of the flux, in transitions per 1/_FLUX_RATE (assumed: eddy currents saturate, too).
At twice this rate the side of the loop would change faster than a step of `identify` can follow:
the
product of both rates and the step must be below 2.78, where classical Runge-Kutta is stable."""


def transport_delay_early_set_point(period: float, time: float, history: Array) -> float:
    """Return the set point before the one that arrives within this tick."""
    return sample_of(history, int(time / period) + 1)


def transport_delay_arrival(period: float, time: float) -> float:
    """Return the arrival time of the set point sent a whole number of ticks before this tick."""
    return time - int(time / period) * period


@effect(
    late_set_point,
    knob=Param("time", "s", "age of the set point that acts", 1e-3, 0.0, 0.1, shown="ms"),
    states=(Quantity("history", "A", "set points of the last ticks", length=HISTORY),),
    also=(
        (early_set_point, transport_delay_early_set_point),
        (arrival, transport_delay_arrival),
    ),
    source="dead time of a bus and a digital driver; 0 to 3 ms assumed",
    signature="phase of everything against the set point, proportional to frequency",
    not_modelled="jitter of the delay; set points older than 127 ticks",
)
def transport_delay(set_point: float, period: float, time: float, history: Array) -> float:
    """u(t) = u_set(t - T_d), held from one set point to the next.

    The set point arrives late.
    """
    remember(history, set_point)
    return sample_of(history, int(time / period))


@effect(
    command,
    knob=Param(
        "limit", "A", "largest coil current", 0.01, 1e-4, math.inf, shown="mA", off=math.inf
    ),
    source="S1 3.3; rated current of the Moog E024 in public HyQ bench scripts",
    signature="flat tops of both chamber flows at large commands",
    not_modelled="the driver's supply voltage",
)
def current_saturation(current: float, limit: float) -> float:
    """u = max(-I_max, min(I_max, u)).

    The driver limits the current.
    """
    return max(-limit, min(limit, current))


@effect(
    command,
    knob=Param("time_constant", "s", "time constant of the closed current loop",
               2e-4, 0.0, 0.2, shown="ms"),
    states=(Quantity("coil_current", "A", "current in the coil"),),
    source="inductance and resistance of the coil under a current loop: first order",
    signature="phase of the pressures against the set point; like a slower spool",
    not_modelled="back electromotive force of the moving armature",
)  # fmt: skip
def driver_lag(current: float, coil_current: float, time_constant: float) -> tuple[float, float]:
    """di/dt = (u - i) / tau.

    The current lags behind its set point.
    """
    return coil_current, (current - coil_current) / time_constant


@effect(
    command,
    knob=Param("width", "A", "width of the loop between current and spool",
               2e-4, 0.0, 2e-3, shown="mA"),
    shape=(
        Param("transition", "A", "current within which the loop changes its side",
              2e-4, 5e-5, 2e-3, shown="mA", default=2e-4, spread=factor(2.0)),
    ),
    states=(
        Quantity("flux", "A", "magnetisation of the torque motor, as the current it belongs to"),
        Quantity("side", "1", "side of the loop, -1 to 1"),
    ),
    source="standard servo-valve specification (hysteresis, below 3 %); loop of Dahl 1968, chosen "
           "over a play operator because it needs no event and no memory of extremes",
    signature="slow ramps: spool, pressures and flow against current run on two branches",
    not_modelled="minor loops of the magnetic circuit; for friction of the spool see threshold",
)  # fmt: skip
def hysteresis(
    current: float, flux: float, side: float, width: float, transition: float
) -> tuple[float, float, float]:
    """u = i - (h/2) z,  dz/dt = (di/dt - |di/dt| z) / i_t.

    The torque motor's iron remembers: the valve stands elsewhere after a rising current.


    Eddy currents limit the rate of the flux, so that steps have a finite rate, too.
    """
    farthest = _FASTEST * transition
    change = _FLUX_RATE * max(-farthest, min(farthest, current - flux))
    return current - 0.5 * width * side, change, (change - abs(change) * side) / transition


@effect(
    command,
    knob=Param("bias", "A", "offset of the null", 1e-4, -2e-3, 2e-3, shown="mA"),
    source="standard servo-valve specification (null bias, up to 3 % of rated current)",
    signature="constant rate of both chamber pressures at zero command",
    not_modelled="ageing",
)
def null_bias(current: float, bias: float) -> float:
    """u = u + u_b.

    The valve's null lies at another current.
    """
    return current + bias


@effect(
    command,
    knob=Param("shift", "A", "null shift per relative change of supply pressure",
               2e-4, -2e-3, 2e-3, shown="mA"),
    shape=(
        Param("rated_pressure", "Pa", "supply pressure at which the null is right", 210e5, 1e5,
              400e5, shown="bar", default=210e5, source="S1 3.3.1", spread=SETTING),
    ),
    source="standard servo-valve specification (null shift with supply pressure, below 2 %)",
    signature="rate of both chamber pressures at zero command, moving with supply pressure",
    not_modelled="shift with tank pressure and temperature",
)  # fmt: skip
def null_shift(current: float, port_s: float, shift: float, rated_pressure: float) -> float:
    """u = u + s (p_s - p_n) / p_n.

    The valve's null moves with the supply pressure.
    """
    return current + shift * (port_s - rated_pressure) / rated_pressure


@effect(
    pilot,
    knob=Param("share", "1", "share of the pilot stage's speed that supply pressure governs",
               1.0, 0.0, 1.0),
    shape=(
        Param("rated_pressure", "Pa", "supply pressure at which spool data hold", 210e5, 1e5,
              400e5, shown="bar", default=210e5, source="S1 3.3.1", spread=SETTING),
    ),
    source="pilot flow grows as the square root of pressure (Merritt 1967); S1 3.3.1 for 210 bar",
    signature="bandwidth and rate limit of the spool fall with supply pressure",
)  # fmt: skip
def pilot_supply(
    bandwidth_factor: float, port_s: float, share: float, rated_pressure: float
) -> float:
    """w_v, R = (w_v, R) (1 + k (sqrt(p_s/p_n) - 1)).

    The spool is quicker at a higher supply pressure.
    """
    return bandwidth_factor * (1.0 + share * (math.sqrt(port_s / rated_pressure) - 1.0))


@effect(
    spool_force,
    knob=Param("stiffness", "1", "flow-force over restoring stiffness at the rated drop",
               0.02, 0.0, 0.5, shown="%"),
    shape=(
        Param("rated_drop", "Pa", "pressure drop over both edges", 70e5, 1e5, 400e5, shown="bar",
              default=70e5, spread=SETTING, difference=True),
    ),
    source="steady flow force 2 C_d C_v w x dp cos(69°) (Merritt 1967); ratio assumed",
    signature="the spool opens less at a high pressure drop",
    not_modelled="transient flow force",
)  # fmt: skip
def flow_force(
    deviation: float, spool_position: float, valve_drop: float, stiffness: float, rated_drop: float
) -> float:
    """e = e - k_f u_v dp / dp_n: closing, proportional to opening and pressure drop.

    The flow pushes the spool closed.
    """
    return deviation - stiffness * spool_position * max(0.0, valve_drop) / rated_drop


@effect(
    spool_force,
    knob=Param("current", "A", "current that must change before the spool moves",
               2.5e-5, 0.0, 2e-3, shown="uA"),
    source="standard servo-valve specification (threshold, below 0.5 % of rated current)",
    signature="spool, so pressures and flow, rest while the command moves a little",
    not_modelled="dither that dissolves it",
)  # fmt: skip
def threshold(deviation: float, current: float) -> float:
    """e = e - max(-T, min(T, e)): dry friction holds the spool within ±T of its command.

    Dry friction holds the spool: a loop of the spool, while hysteresis is a loop of the torque
    motor.
    """
    return deviation - max(-current, min(current, deviation))


@effect(
    spool_force,
    knob=Param("time_constant", "s", "time constant of armature and pilot within the spool's loop",
               2e-4, 0.0, 0.01, shown="ms"),
    states=(Quantity("lagging", "A", "deviation that the pilot stage acts on"),),
    source="third-order valve: a pilot within the loop that the feedback spring closes (Thayer, "
           "Transfer functions for Moog servovalves, TB 103, 1965); size assumed",
    signature="phase of the spool above its natural frequency; resonance where the pilot is slow",
    not_modelled="the armature's own resonance, above 500 Hz as a rule",
)  # fmt: skip
def pilot_lag(deviation: float, lagging: float, time_constant: float) -> tuple[float, float]:
    """u_v/i = w² / (tau s³ + (1 + 2 D w tau) s² + 2 D w s + w²).

    Armature and pilot stage take time to answer.
    """
    return lagging, (deviation - lagging) / time_constant


@effect(
    spool,
    knob=Param("rate", "A/s", "fastest motion of the spool", 3.6, 1e-3, math.inf, off=math.inf),
    source="S1 3.3.1: 250 Hz at ±25 %, 100 Hz at ±100 %; this one number gives both",
    signature="large, fast commands only: flow lags and becomes triangular",
)
def spool_rate_limit(spool_speed: float, bandwidth_factor: float, rate: float) -> float:
    """du_v/dt = max(-R, min(R, du_v/dt)).

    The spool moves no faster than a limit.
    """
    return max(-rate * bandwidth_factor, min(rate * bandwidth_factor, spool_speed))


@effect(
    spool_reach,
    knob=Param(
        "limit", "A", "largest travel of the spool, as a current", 0.01, 1e-4, math.inf,
        shown="mA", off=math.inf,
    ),
    source="mechanical stops; by default at the rated current, or else at the current at which the "
           "driver saturates",
    signature="flat tops of spool position and flow where a large step would overshoot",
    not_modelled="rebound: the stop absorbs the spool's whole momentum",
)  # fmt: skip
def spool_stops(spool_position: float, limit: float) -> float:
    """u_v = max(-u_max, min(u_max, u_v)), and du_v/dt = 0 once it is there.

    The spool strikes its stops.
    """
    return max(-limit, min(limit, spool_position))


EFFECTS = (
    transport_delay, current_saturation, driver_lag, hysteresis, null_bias, null_shift,
    pilot_supply, flow_force, threshold, pilot_lag, spool_rate_limit, spool_stops,
)  # fmt: skip
