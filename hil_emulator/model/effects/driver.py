"""Functions of a valve's driver: ramp, dead-band compensation, spool feedback, dither.

They are parts of a driver or of on-board electronics: `identify` uses those of the configuration
and does not search for others.
"""

import math

from hil_emulator.model.declare import SETTING, Param, Quantity, effect, factor
from hil_emulator.model.stages import driver

_RAMP_LAG = 1e-3
"""Time constant with which a ramp reaches its end [s] (assumed)."""


@effect(
    driver,
    knob=Param("rate", "A/s", "fastest change of the ramped set point", 0.1, 1e-4, math.inf,
               off=math.inf),
    states=(Quantity("ramped", "A", "set point after the ramp"),),
    source="ramp of a proportional amplifier, 0.02 to 5 s from 0 to 100 %",
    signature="valve current rises linearly after a step of the set point",
    not_modelled="different ramps up and down, and for both directions",
)  # fmt: skip
def ramp(current: float, ramped: float, rate: float) -> tuple[float, float]:
    """du/dt = max(-R, min(R, (u_set - u)/tau)).

    The amplifier lets its set point change only so fast.
    """
    return ramped, max(-rate, min(rate, (current - ramped) / _RAMP_LAG))


@effect(
    driver,
    knob=Param("jump", "A", "current added beyond null", 1e-4, 0.0, 6e-3, shown="mA"),
    shape=(
        Param("window", "A", "set point at which the whole jump is added", 1e-4, 1e-6, 2e-3,
              shown="mA", default=1e-4, spread=SETTING),
    ),
    source="dead-band compensation of a proportional amplifier (minimum current)",
    signature="the valve opens at small set points, though its lands overlap",
)  # fmt: skip
def dead_band_compensation(current: float, jump: float, window: float) -> float:
    """u = u + j max(-1, min(1, u/w)).

    The amplifier jumps over the valve's dead band.
    """
    return current + jump * max(-1.0, min(1.0, current / window))


@effect(
    driver,
    knob=Param("bandwidth", "Hz", "bandwidth of the loop around the spool", 5.0, 0.0, 200.0),
    shape=(
        Param("authority", "A", "largest correction", 1e-3, 1e-5, 1e-2, shown="mA", default=1e-3,
              spread=factor(2.0)),
    ),
    states=(Quantity("correction", "A", "correction of the set point by the loop"),),
    source="integral controller on the spool's transducer, as electronics on board have",
    signature="spool reaches its set point despite bias, hysteresis or friction",
    not_modelled="proportional and derivative parts: the spool's own frequency and damping are of "
                 "the closed loop, as data sheets state them; transducer errors",
)  # fmt: skip
def spool_feedback(
    current: float, spool_position: float, correction: float, bandwidth: float, authority: float
) -> tuple[float, float]:
    """u = u + z,  dz/dt = 2 pi f (u - u_v), less where z comes near its limit.

    The electronics move the spool to where it was commanded.
    """
    rate = 2.0 * math.pi * bandwidth * (current - spool_position)
    part = correction / authority
    outwards = rate * correction > 0.0
    return current + correction, rate * (max(0.0, 1.0 - part * part) if outwards else 1.0)


@effect(
    driver,
    knob=Param("amplitude", "A", "amplitude of the ripple", 2e-4, 0.0, 2e-3, shown="mA"),
    shape=(
        Param("frequency", "Hz", "frequency of the ripple", 150.0, 10.0, 1000.0, default=150.0,
              source="dither 100 to 300 Hz; pulse-width modulation of solenoids 80 to 400 Hz",
              spread=SETTING),
    ),
    states=(Quantity("phase", "1", "phase in radian"),),
    source="dither of an amplifier, or the fundamental of the current's ripple under pulse-width "
           "modulation behind the coil's inductance",
    signature="the spool trembles, and its threshold is dissolved",
    not_modelled="harmonics of the ripple, and its decrease towards 0 and 100 % duty cycle",
)  # fmt: skip
def dither(current: float, phase: float, amplitude: float, frequency: float) -> tuple[float, float]:
    """u = u + a sin(phi),  dphi/dt = 2 pi f.

    The current trembles, so that the spool does not stick.
    """
    return current + amplitude * math.sin(phase), 2.0 * math.pi * frequency


EFFECTS = (ramp, dead_band_compensation, spool_feedback, dither)
