"""Detection of channels that were logged by two clocks.

The rod follows the valve, and the load cell and the forces of the motion follow the pressures. Each
lag is a property of the machine. A lag that grows with time, or that is longer than an actuator's,
comes from two clocks.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from hil_emulator.identify.data_checks.lags import FARTHEST, cross, lags_of, peak
from hil_emulator.identify.measured.experiment import Array, Experiment

FEWEST_LAGS = 6
"""Stretches needed to detect a drift."""

FEWEST_STEADY_LAGS = 4
"""Stretches needed to detect a constant lag (assumed)."""

LAG_GROWTH = 12e-3
"""Growth of the lag within an experiment above that of a fast machine [s] (assumed). With a healthy
valve the lag of the rod changes with the motion, by up to half of this in two seconds of steps."""

SIGNIFICANT_GROWTH = 6.0
"""Growth in standard errors from which it is significant."""

LAG = 0.05
"""Lag of a rod or a force above that of a fast actuator [s]; servo valves have 5 ms (assumed)."""

TURNED = 0.5
"""Largest lag of the speed in periods of the mass on its oil: above the natural frequency the phase
is reversed, which is half a period of a higher frequency."""

SWUNG = 1.0
"""Apparent lag between forces and motion in periods of a mass that swings on its oil: consecutive
swings are similar, and so are friction and the inertial force a quarter of a period later."""

MOTION_WINDOW = 0.02
"""Time over which velocity and acceleration are fitted to the position [s]."""

DRY_FRICTION_SHARE = 0.1
"""Speed of full dry friction, over the standard deviation of the speed (assumed)."""


@dataclass(frozen=True)
class Following:
    """A leading quantity, and the quantities that follow it with one lag.

    Attributes:
        names: of the leader and of the follower.
        leader: values of the leader.
        followers: regressors of the leader that share one lag.
        instant: regressors of the leader without a lag.
        machine: possible lag of the machine, in addition to the valve's [s].

    """

    names: tuple[str, str]
    leader: Array
    followers: tuple[Array, ...]
    instant: tuple[Array, ...] = ()
    machine: float = 0.0


def two_clocks(
    experiments: Sequence[Experiment], force: Callable[[Experiment], Array], frequency: float
) -> list[str]:
    """Return a message for each pair of channels that two clocks have logged.

    Args:
        experiments: on their grids.
        force: returns the hydraulic force of an experiment [N].
        frequency: natural frequency of the mass on its oil [Hz]; NaN if it is unknown, as on
            benches that are not a complete actuator. The machine then counts as a fast one.

    """
    messages, swing = [], 1.0 / frequency if np.isfinite(frequency) else 0.0
    for e in experiments:
        for following in _followings(e, force, swing):
            lag = _lag_error(following, e.period)
            if lag:
                first, second = following.names
                messages.append(
                    f"{e.name}: {second} follows {first} {lag}; the channels come from two "
                    "clocks, so put them on one"
                )
                break
    return messages


def _followings(
    e: Experiment, force: Callable[[Experiment], Array], swing: float
) -> list[Following]:
    """Return the pairs of leader and followers, for a machine that swings with a period [s]."""
    pairs = []
    pressures = {"pressure_a", "pressure_b"} <= set(e.readings)
    moving = "position" in e.readings
    if len(e.current) and moving:
        speed, machine_lag = (motion(e, 1),), TURNED * swing
        pairs.append(
            Following(("valve_current", "position"), e.current, speed, machine=machine_lag)
        )
    if pressures and "load_force" in e.readings:
        cell = e.readings["load_force"]
        pairs.append(Following(("pressure", "load_force"), force(e), (cell,), friction(e)))
    if pressures and moving:
        forces, machine_lag = (motion(e, 2), *friction(e)), SWUNG * swing
        pairs.append(Following(("pressure", "position"), force(e), forces, machine=machine_lag))
    return pairs


def friction(e: Experiment) -> tuple[Array, ...]:
    """Return regressors of viscous and dry friction; an empty tuple without a position."""
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


def _lag_error(f: Following, period: float) -> str:
    """Return the error of the lags in words; "" if there is no error."""
    times, lags = lags_of(f.leader, f.followers, f.instant, period)
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
