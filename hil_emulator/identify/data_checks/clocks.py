"""Channels from two loggers: a lag between quantities that physics ties together.

Quantities move together, one after the other by a time that belongs to the machine: the rod follows
the valve, the load cell follows the pressures less friction, the forces of the motion follow them,
too. A lag that grows with time belongs to two clocks; so does one that no actuator has.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from hil_emulator.identify.data_checks.lags import FARTHEST, cross, lags_of, peak
from hil_emulator.identify.measured.experiment import Array, Experiment

FEWEST_LAGS = 6
"""Stretches from which a drift can be told."""

FEWEST_STEADY_LAGS = 4
"""Stretches from which a lag that stays can be told (assumed)."""

LAG_GROWTH = 12e-3
"""Growth of the lag within an experiment that is no quick machine's [s] (assumed): the lag of a rod
behind a healthy valve changes with the motion, by up to half of it in two seconds of steps."""

SIGNIFICANT_GROWTH = 6.0
"""Standard errors by which the growth must stand out."""

LAG = 0.05
"""Lag of a rod or a force that no quick actuator has [s]; a servo valve's is a tenth (assumed)."""

TURNED = 0.5
"""Periods of a mass on its oil by which its speed is late at most: above the natural frequency it
turns against what drives it, by half a period of something quicker."""

SWUNG = 1.0
"""Periods of a mass that swings on its oil by which forces and motion seem to be late: one swing
resembles the next, and friction of a speed a quarter later the force of an acceleration."""

MOTION_WINDOW = 0.02
"""Time over which velocity and acceleration are fitted to the position [s]."""

DRY_FRICTION_SHARE = 0.1
"""Part of the speed's deviation at which dry friction has its full size (assumed)."""


@dataclass(frozen=True)
class Following:
    """Quantities that follow another one.

    Attributes:
        names: of what leads and of what follows.
        leader: values of the one.
        followers: values of the others; together, and with one lag, they account for it.
        beside: what accounts for it without a lag.
        machine: lag that may be the machine's own, besides a valve's [s].

    """

    names: tuple[str, str]
    leader: Array
    followers: tuple[Array, ...]
    beside: tuple[Array, ...] = ()
    machine: float = 0.0


def two_clocks(
    experiments: Sequence[Experiment], force: Callable[[Experiment], Array], frequency: float
) -> list[str]:
    """Return what tells that the channels of an experiment come from two clocks.

    Args:
        experiments: on their grids.
        force: returns the hydraulic force of an experiment [N].
        frequency: natural frequency of the mass on its oil [Hz]; NaN where nobody has stated it, as
            on benches that are no whole actuator: it is taken for a quick one.

    """
    found, swing = [], 1.0 / frequency if np.isfinite(frequency) else 0.0
    for e in experiments:
        for following in _followings(e, force, swing):
            said = _said(following, e.period)
            if said:
                first, second = following.names
                found.append(
                    f"{e.name}: {second} follows {first} {said}; the channels come from two "
                    "clocks, so put them on one"
                )
                break
    return found


def _followings(
    e: Experiment, force: Callable[[Experiment], Array], swing: float
) -> list[Following]:
    """Return what follows what, on a machine that swings with a period [s]."""
    found = []
    pressures = {"pressure_a", "pressure_b"} <= set(e.readings)
    moving = "position" in e.readings
    if len(e.current) and moving:
        speed, own = (motion(e, 1),), TURNED * swing
        found.append(Following(("valve_current", "position"), e.current, speed, machine=own))
    if pressures and "load_force" in e.readings:
        cell = e.readings["load_force"]
        found.append(Following(("pressure", "load_force"), force(e), (cell,), friction(e)))
    if pressures and moving:
        forces, own = (motion(e, 2), *friction(e)), SWUNG * swing
        found.append(Following(("pressure", "position"), force(e), forces, machine=own))
    return found


def friction(e: Experiment) -> tuple[Array, ...]:
    """Return viscous and dry friction, each of any size; nothing without a position."""
    if "position" not in e.readings:
        return ()
    v = motion(e, 1)
    return v, np.tanh(v / (DRY_FRICTION_SHARE * max(float(np.nanstd(v)), 1e-6)))


def motion(e: Experiment, derivative: int) -> Array:
    """Return a derivative of the position by sliding parabolas, NaN where it is missing."""
    position = e.readings["position"]
    good = np.isfinite(position)
    index = np.arange(len(position))
    filled = np.interp(index, index[good], position[good])
    width = min(
        max(5, round(MOTION_WINDOW / e.period) // 2 * 2 + 1), (len(position) - 1) // 2 * 2 - 1
    )
    values = savgol_filter(filled, width, 2, deriv=derivative, delta=e.period)
    return np.asarray(np.where(good, values, np.nan))


def _said(f: Following, period: float) -> str:
    """Return in words what is wrong with the lags, or ""."""
    times, lags = lags_of(f.leader, f.followers, f.beside, period)
    if len(lags) < FEWEST_STEADY_LAGS:
        return ""
    typical, most = float(np.median(lags)), max(LAG, f.machine)
    if abs(typical) > most and np.median(np.abs(lags - typical)) < 0.3 * abs(typical):
        return f"{typical * 1e3:.0f} ms late" if typical > 0 else f"{-typical * 1e3:.0f} ms early"
    if len(lags) < FEWEST_LAGS:
        return ""
    design = np.column_stack([np.ones(len(times)), times - times.mean()])
    (_, slope), *_ = np.linalg.lstsq(design, lags, rcond=None)
    rest = lags - design @ np.array([lags.mean(), slope])
    error = float(np.std(rest)) / max(float(np.sqrt(np.sum((times - times.mean()) ** 2))), 1e-30)
    growth = slope * (times[-1] - times[0])
    least = max(LAG_GROWTH, 2.0 * period, f.machine)
    if abs(growth) < least or abs(slope) < SIGNIFICANT_GROWTH * error:
        return ""
    return (
        f"{lags[0] * 1e3:.1f} ms late at first and {lags[-1] * 1e3:.1f} ms at last, "
        f"a drift of {slope * 1e3:.2g} ms/s"
    )


def likeness(a: Array, b: Array, period: float) -> float:
    """Return the largest correlation of two channels at any lag."""
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < 20:
        return 0.0
    one = np.where(good, a - np.mean(a[good]), 0.0)
    other = np.where(good, b - np.mean(b[good]), 0.0)
    scale = float(np.sqrt(np.sum(one**2) * np.sum(other**2)))
    if scale <= 0.0:
        return 0.0
    reach = min(round(FARTHEST / period), len(a) // 4)
    products = cross(one[None, :, None], other[None, :, None], reach)
    return peak(products[0, :, 0, 0])[1] / scale
