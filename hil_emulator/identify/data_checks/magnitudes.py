"""Readings that are impossible for the configured actuator: wrong units or exchanged columns.

Every limit is a factor of at least eight, which separates bar from MPa and exceeds any effect.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from hil_emulator.identify.data_checks.clocks import motion
from hil_emulator.identify.data_checks.unit_mistakes import likely, of_position
from hil_emulator.identify.measured.data import IMPLAUSIBLE_SPANS
from hil_emulator.identify.measured.experiment import (
    FLOWS,
    REFERENCE,
    SPANS,
    UNITS,
    Array,
    Experiment,
    noise_of,
)
from hil_emulator.model.sensors import CHANNELS
from hil_emulator.units import read_as, show

WRONG_UNIT_RATIO = 8.0
"""Ratio to the configuration from which a unit is wrong (assumed)."""

CHAMBER_SUM_RATIO = 6.0
"""Sum of both chambers' pressures over the supply's, or its inverse, from which a unit is wrong
(assumed: a valve's two edges share the supply's pressure between them)."""

SLOWEST_RATIO = 200.0
"""Largest ratio of the speed that the valve allows and the fastest measured speed (assumed)."""

VACUUM = -10e5
"""Pressure below that of any fluid, an error of the sensor included [Pa] (assumed)."""

NEGATIVE = 0.1
"""Part of the readings that may be below it, because a line rings (assumed)."""

HIGHEST_PRESSURE = 1000e5
"""Pressure above that of any cylinder [Pa] (assumed: presses are built for up to 700 bar)."""

HARDEST_DRIVE = 1e3
"""Acceleration above that of any driven axis [m/s^2] (assumed)."""

CREEP = 2e-3
"""Change of speed that leakage or a load can cause with the valve closed [m/s] (assumed)."""

NOISE_SHARE = 0.2
"""Ratio of noise and range of a position from which it shows no motion (assumed)."""

_SHOWN = {c.name: (c.unit, c.shown) for c in CHANNELS} | {
    **{f: (UNITS[f], "l/min") for f in FLOWS},
    REFERENCE: ("m", "mm"),
}


def _shown(channel: str, value: float) -> str:
    unit, linear = _SHOWN[channel]
    return show(value, unit, read_as(unit, linear))


_PRESSURES = ("pressure_a", "pressure_b", "supply_pressure")


def impossible(experiments: Sequence[Experiment], plant: Mapping[str, float]) -> list[str]:
    """Return a message for each reading that is impossible for the configured actuator."""
    return [f"{e.name}: {text}" for e in experiments for text in _of_one(e, plant)]


def _of_one(e: Experiment, plant: Mapping[str, float]) -> list[str]:
    messages = [_position(e, plant), _supply(e, plant), _chambers(e, plant)]
    if not any(messages):
        messages += [_far(name, values, plant) for name, values in e.readings.items()]
    messages += [_pressure(name, e.readings[name]) for name in _PRESSURES if name in e.readings]
    texts = [text for text in messages if text]
    return texts or [text for text in (_speed(e, plant),) if text]


def _far(name: str, values: Array, plant: Mapping[str, float]) -> str:
    typical = float(np.nanmedian(np.abs(values)))
    if typical <= max(IMPLAUSIBLE_SPANS * SPANS[name], _reach(name, plant)):
        return ""
    return f"{name} is about {_shown(name, typical)}, far beyond any range; is its unit right?"


def _reach(name: str, plant: Mapping[str, float]) -> float:
    """Return the largest plausible value for a machine of this size; infinite if unknown."""
    if name == "position":
        stroke = plant["cylinder_stroke"]
        return math.inf if math.isnan(stroke) else 2.0 * stroke
    if name != "load_force":
        return 0.0
    area = plant["cylinder_piston_area"]
    return HIGHEST_PRESSURE * area if area > 0.0 else HARDEST_DRIVE * plant["load_mass"]


def _pressure(name: str, values: Array) -> str:
    low = float(np.nanquantile(values, NEGATIVE))
    if low >= VACUUM:
        return ""
    return f"{name} falls to {_shown(name, low)}, below vacuum; is it a pressure?"


def _position(e: Experiment, plant: Mapping[str, float]) -> str:
    if "position" not in e.readings:
        return ""
    values = e.readings["position"]
    travel, stroke = (
        float(np.nanmax(values) - np.nanmin(values)),
        plant["cylinder_stroke"],
    )
    if travel > 1.5 * stroke:
        return (
            f"position moves over {show(travel, 'm', 'mm')}, and the stroke is "
            f"{show(stroke, 'm', 'mm')}{of_position(values, stroke)}; is its unit right, and is it "
            "the position?"
        )
    if travel > 0.0 and noise_of(values) > NOISE_SHARE * float(np.nanstd(values)):
        return "position is noise; it shows no motion"
    return ""


def _supply(e: Experiment, plant: Mapping[str, float]) -> str:
    if "supply_pressure" not in e.readings:
        return ""
    measured = float(np.nanmedian(e.readings["supply_pressure"]))
    configured = plant["supply_pressure"]
    if not configured / WRONG_UNIT_RATIO < measured < configured * WRONG_UNIT_RATIO:
        return (
            f"supply_pressure is about {show(measured, 'Pa', 'bar')}, and the configuration has "
            f"{show(configured, 'Pa', 'bar')}{likely('Pa', measured / configured)}; is its unit "
            "right?"
        )
    for name in ("pressure_a", "pressure_b"):
        typical = float(np.nanmedian(e.readings[name])) if name in e.readings else 0.0
        if typical > 1.1 * measured and len(e.current):
            wrong = typical > 3.0 * measured
            return (
                f"{name} is about {show(typical, 'Pa', 'bar')}, and supply_pressure only "
                f"{show(measured, 'Pa', 'bar')}; "
                f"{'is its unit right?' if wrong else 'are they exchanged?'}"
            )
    return ""


def _chambers(e: Experiment, plant: Mapping[str, float]) -> str:
    both = [e.readings[n] for n in ("pressure_a", "pressure_b") if n in e.readings]
    if not both or not len(e.current):
        return ""
    highest = max(float(np.nanquantile(p, 0.99)) for p in both)
    configured = plant["supply_pressure"]
    ratio = float(np.nanmedian(np.sum(both, axis=0))) / configured
    if len(both) == 2 and not 1.0 / CHAMBER_SUM_RATIO < ratio < CHAMBER_SUM_RATIO:
        return (
            f"pressure_a and pressure_b together are about {ratio:.2g} times the supply"
            f"{likely('Pa', ratio)}; are their units right?"
        )
    if highest > configured / (10.0 * WRONG_UNIT_RATIO):
        return ""
    return (
        f"no chamber pressure exceeds {show(highest, 'Pa', 'bar')} at a supply of "
        f"{show(configured, 'Pa', 'bar')}; is the unit right?"
    )


def _speed(e: Experiment, plant: Mapping[str, float]) -> str:
    """Compare the fastest motion of the rod with the speed that the largest set point allows."""
    if not len(e.current) or "position" not in e.readings:
        return ""
    p = plant
    top = float(np.quantile(np.abs(e.current), 0.99))
    limit = p.get("current_saturation_limit", np.inf)
    edge = min(0.5 * p["supply_pressure"], p.get("pressure_compensator_setting", np.inf))
    able = p["valve_gain"] * np.sqrt(edge) / p["cylinder_piston_area"]
    velocity = motion(e, 1)
    speed, swing = float(np.nanquantile(np.abs(velocity), 0.99)), float(np.nanstd(velocity))
    if (
        swing > WRONG_UNIT_RATIO * able * float(np.std(e.current)) + CREEP
    ):  # independent of the null of the valve
        return (
            f"the rod moves at {speed:.3g} m/s, {speed / (able * top):.0f} times as fast as "
            f"{show(top, 'A', 'mA')} can drive it; is the unit of valve_current or position right?"
        )
    if np.isfinite(limit) and top > WRONG_UNIT_RATIO * limit:
        return (
            f"valve_current reaches {show(top, 'A', 'mA')}, and the valve takes "
            f"{show(limit, 'A', 'mA')}; is its unit right?"
        )
    return _slow(speed, able, min(top, limit), top, p.get("overlap_lap", 0.0))


def _slow(speed: float, able: float, opening: float, top: float, lap: float) -> str:
    """Compare the speed [m/s] with the one per current [m/(s A)] beyond the dead band [A]."""
    if speed * SLOWEST_RATIO >= able * opening:
        return ""
    if speed * SLOWEST_RATIO >= able * (opening - lap):
        return (
            f"{show(top, 'A', 'mA')} hardly leaves the dead band of ±{show(lap, 'A', 'mA')}, where "
            "leakage alone moves the rod; record larger currents"
        )
    return (
        f"{show(top, 'A', 'mA')} could drive the rod {able * top / speed:.0f} times as fast as "
        "it moves; is the unit of valve_current or position right?"
    )
