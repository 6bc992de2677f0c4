"""Channels from two loggers: a lag between quantities that physics ties together.

Each pair moves together, the second after the first by a time that belongs to the machine: the rod
follows the valve, the load cell follows the pressures, the load's acceleration follows them, too. A
lag that grows with time belongs to two clocks; so does one that no actuator has.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import savgol_filter

from hil_emulator.identify.measured.experiment import Array, Experiment

LAG_WINDOW = 0.5
"""Length of a stretch in which one lag is measured [s] (assumed)."""

FARTHEST = 0.2
"""Lag up to which a pair is compared [s] (assumed)."""

LAG_CORRELATION = 0.6
"""Correlation of a stretch from which its lag counts."""

FEWEST_LAGS = 6
"""Stretches from which a drift can be told."""

LAG_GROWTH = 12e-3
"""Growth of the lag within an experiment that is no machine's [s] (assumed): the lag of a rod
behind a healthy valve changes with the motion, by up to half of it in two seconds of steps."""

SIGNIFICANT_GROWTH = 6.0
"""Standard errors by which the growth must stand out."""

LAG = 0.05
"""Lag of a rod or a force that no actuator has [s]; a servo valve's is a tenth (assumed)."""

MOTION_WINDOW = 0.02
"""Time over which velocity and acceleration are fitted to the position [s]."""

_Pair = tuple[str, str, Array, Array]


def two_clocks(
    experiments: Sequence[Experiment], force: Callable[[Experiment], Array]
) -> list[str]:
    """Return what tells that the channels of an experiment come from two clocks.

    Args:
        experiments: on their grids.
        force: returns the hydraulic force of an experiment [N].

    """
    found = []
    for e in experiments:
        for first, second, a, b in _pairs(e, force):
            said = _said(a, b, e.period)
            if said:
                found.append(
                    f"{e.name}: {second} follows {first} {said}; the channels come from two "
                    "clocks, so put them on one"
                )
                break
    return found


def _pairs(e: Experiment, force: Callable[[Experiment], Array]) -> list[_Pair]:
    pairs: list[_Pair] = []
    pressures = {"pressure_a", "pressure_b"} <= set(e.readings)
    driven = len(e.current) > 0 and "position" in e.readings
    if driven:
        pairs.append(("valve_current", "position", e.current, motion(e, 1)))
    if pressures and "load_force" in e.readings:
        pairs.append(("pressure", "load_force", force(e), e.readings["load_force"]))
    # friction makes this lag depend on frequency, which a chirp changes all the time
    if pressures and "position" in e.readings and not driven:
        pairs.append(("pressure", "position", force(e), motion(e, 2)))
    return pairs


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


def _said(a: Array, b: Array, period: float) -> str:
    """Return in words what is wrong with the lags of a pair, or ""."""
    times, lags = lags_of(a, b, period)
    if len(lags) < FEWEST_LAGS:
        return ""
    typical = float(np.median(lags))
    if abs(typical) > LAG and np.median(np.abs(lags - typical)) < 0.3 * abs(typical):
        return f"{typical * 1e3:.0f} ms late" if typical > 0 else f"{-typical * 1e3:.0f} ms early"
    design = np.column_stack([np.ones(len(times)), times - times.mean()])
    (_, slope), *_ = np.linalg.lstsq(design, lags, rcond=None)
    rest = lags - design @ np.array([lags.mean(), slope])
    error = float(np.std(rest)) / max(float(np.sqrt(np.sum((times - times.mean()) ** 2))), 1e-30)
    growth = slope * (times[-1] - times[0])
    least = max(LAG_GROWTH, 2.0 * period)
    if abs(growth) < least or abs(slope) < SIGNIFICANT_GROWTH * error:
        return ""
    return (
        f"{lags[0] * 1e3:.1f} ms late at first and {lags[-1] * 1e3:.1f} ms at last, "
        f"a drift of {slope * 1e3:.2g} ms/s"
    )


def lags_of(a: Array, b: Array, period: float) -> tuple[Array, Array]:
    """Return times and lags [s] of `b` after `a` in the stretches where both move alike."""
    length = round(LAG_WINDOW / period)
    reach = round(FARTHEST / period)
    times, lags = [], []
    for start in range(0, len(a) - length + 1, max(1, length // 2)):
        one, other = a[start : start + length], b[start : start + length]
        if not (np.isfinite(one).all() and np.isfinite(other).all()):
            continue
        lag, likeness = _lag(one - one.mean(), other - other.mean(), min(reach, length // 2))
        if likeness > LAG_CORRELATION and abs(lag) < min(reach, length // 2):
            times.append((start + 0.5 * length) * period)
            lags.append(lag * period)
    return np.array(times), np.array(lags)


def likeness(a: Array, b: Array, period: float) -> float:
    """Return the largest correlation of two channels at any lag."""
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < 20:
        return 0.0
    one = np.where(good, a - np.mean(a[good]), 0.0)
    other = np.where(good, b - np.mean(b[good]), 0.0)
    return _lag(one, other, min(round(FARTHEST / period), len(a) // 4))[1]


def _lag(a: Array, b: Array, reach: int) -> tuple[float, float]:
    """Return the lag in samples at which the correlation is largest, and that correlation."""
    scale = float(np.sqrt(np.sum(a**2) * np.sum(b**2)))
    if scale <= 0.0:
        return 0.0, 0.0
    size = 2 ** int(np.ceil(np.log2(2 * len(a))))
    product = np.fft.irfft(np.fft.rfft(b, size) * np.conj(np.fft.rfft(a, size)), size)
    around = np.concatenate([product[-reach:], product[: reach + 1]]) / scale
    peak = int(np.argmax(around))
    if not 0 < peak < len(around) - 1:
        return float(peak - reach), float(around[peak])
    left, top, right = around[peak - 1 : peak + 2]
    bend = left - 2.0 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return peak - reach + shift, float(top)
