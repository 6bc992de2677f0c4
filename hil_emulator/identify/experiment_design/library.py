"""The library of experiments: position targets over time.

A bench is driven in closed loop, so an experiment is a position target. Each shape is a function of
time without a unit, between -1 and 1, zero at the start. An experiment scales it by its amplitude
around a centre, stays away from the stops, and below the speed that the valve can give.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hil_emulator.errors import UserError, did_you_mean
from hil_emulator.identify.experiment_design import shapes
from hil_emulator.identify.experiment_design.shapes import ENTRY, Shape, smooth
from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.plant.rating import largest_current, velocity_gain
from hil_emulator.units import show

CLEARANCE = 0.05
"""Part of the stroke that stays free at both stops (assumed)."""

SPEED_SHARE = 0.5
"""Largest speed of a smooth target over the no-load speed at full current (assumed)."""


@dataclass(frozen=True)
class Limits:
    """Limits of a machine.

    Attributes:
        start: position at rest [m].
        low: lowest target [m].
        high: highest target [m].
        speed: largest speed of a smooth target [m/s].

    """

    start: float
    low: float
    high: float
    speed: float

    @property
    def room(self) -> float:
        """Distance from the start to the nearer end [m]."""
        return min(self.high - self.start, self.start - self.low)


@dataclass(frozen=True)
class Stimulus:
    """An entry of the library.

    Attributes:
        name: on the command line.
        summary: the motion.
        shows: effects that it shows well.
        shape: deviation over time, between -1 and 1.
        share: usual amplitude over the distance to the nearer limit.
        duration: usual duration [s].
        jumps: whether the target jumps, so that the valve and not the target limits the speed.
        central: whether it moves around the middle of the stroke instead of the start.

    """

    name: str
    summary: str
    shows: str
    shape: Shape
    share: float
    duration: float = 2.0
    jumps: bool = False
    central: bool = False


@dataclass(frozen=True)
class Target:
    """An experiment, ready to be played.

    Attributes:
        stimulus: the entry of the library.
        amplitude: largest deviation from the centre [m].
        time: [s], evenly spaced.
        position: where the rod should be [m].

    """

    stimulus: Stimulus
    amplitude: float
    time: Array
    position: Array


def limits(plant: Mapping[str, float]) -> Limits:
    """Return the limits of a configured plant."""
    stroke = plant["cylinder_stroke"]
    low, high = CLEARANCE * stroke, (1.0 - CLEARANCE) * stroke
    start = min(max(plant.get("initial_position", 0.5 * stroke), low), high)
    return Limits(start, low, high, SPEED_SHARE * largest_current(plant) * velocity_gain(plant))


LIBRARY: tuple[Stimulus, ...] = (
    Stimulus("multisine", "sines from 0.6 to 37 Hz", "most effects: the first one to record",
             shapes.multisine, 0.35),
    Stimulus("fast_multisine", "sines from 2 to 60 Hz, at the speed limit",
             "flow curves, supply and return line, delays, inertia", shapes.fast_multisine, 0.25),
    Stimulus("steps", "jumps to random levels, held for 0.3 s",
             "leakage, overlap, offsets, laws that depend on the opening",
             shapes.steps, 0.35, jumps=True),
    Stimulus("pseudo_random", "jumps between two levels at multiples of 60 ms",
             "delays, lags, rate limits, air", shapes.pseudo_random, 0.1, jumps=True),
    Stimulus("triangles", "ramps to and fro in 1 s", "friction, its asymmetry, hysteresis",
             shapes.triangles, 0.3),
    Stimulus("stroke", "one slow ramp to and fro over the whole stroke",
             "what depends on position: springs, friction and leakage along the stroke",
             shapes.stroke, 1.0, 4.0, central=True),
    Stimulus("ramp_and_hold", "slow ramps and rests of 0.3 s",
             "leakage, load, pressure friction: forces and flows at rest",
             shapes.ramp_and_hold, 0.6),
    Stimulus("chirp", "a sine from 2 to 40 Hz, ever smaller", "dynamics: spool, oil, sensor lags",
             shapes.chirp, 0.08),
    Stimulus("micro_motion", "sines below 1 mm",
             "friction at low speed, dead band, threshold; little else",
             shapes.micro_motion, 0.015),
)  # fmt: skip
"""Every experiment, in the recommended order."""


def stimulus(name: str) -> Stimulus:
    """Return an entry of the library.

    Raises:
        UserError: if no experiment has that name.

    """
    for entry in LIBRARY:
        if entry.name == name:
            return entry
    raise UserError(f"{name}: no such experiment{did_you_mean(name, [e.name for e in LIBRARY])}")


def target(
    entry: Stimulus, allowed: Limits, amplitude: float | None = None,
    duration: float | None = None, seed: int = 1, period: float = 1e-3,
) -> Target:  # fmt: skip
    """Return an experiment for a machine.

    Args:
        entry: of the library.
        allowed: limits of the machine.
        amplitude: largest deviation from the centre [m]; by default the usual one, or what fits.
        duration: [s]; the usual one without it.
        seed: of levels and phases.
        period: time between two targets [s].

    Raises:
        UserError: if it is too short, or if the rod would meet a stop or outrun the valve.

    """
    lasts = entry.duration if duration is None else duration
    if lasts < 2.0 * ENTRY:
        raise UserError(f"{entry.name}: {lasts:g} s is too short; take {2.0 * ENTRY:g} s or more")
    time = np.asarray(np.arange(round(lasts / period), dtype=np.float64) * period)
    shape = entry.shape(time, np.random.default_rng(seed))
    centre = 0.5 * (allowed.low + allowed.high) if entry.central else allowed.start
    room = min(allowed.high - centre, centre - allowed.low)
    most = room if entry.jumps else min(room, _swiftest(shape, period, allowed.speed))
    chosen = min(entry.share * room, most) if amplitude is None else amplitude
    if not 0.0 < chosen <= most * (1.0 + 1e-9):
        raise UserError(
            f"{entry.name}: an amplitude of {show(chosen, 'm', 'mm')} does not fit; with these "
            f"stops and this valve it is at most {show(most, 'm', 'mm')}"
        )
    approach = (centre - allowed.start) * smooth(time)
    return Target(entry, chosen, time, np.asarray(allowed.start + approach + chosen * shape))


def _swiftest(shape: Array, period: float, speed: float) -> float:
    """Return the amplitude at which a shape reaches a speed [m]."""
    fastest = float(np.max(np.abs(np.diff(shape)))) / period
    return speed / max(fastest, 1e-9)
