"""Signs that contradict the physics: reported, and reversed only where nothing else is possible."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from hil_emulator.identify.experiment import Array, Experiment
from hil_emulator.identify.twin import Twin

CONTRARY = -0.3
"""Correlation below which two channels have opposite senses (assumed)."""


def speed(experiment: Experiment, smoothing: float = 0.15) -> Array:
    """Return the velocity by sliding parabolas, NaN where the position is missing [m/s]."""
    position = experiment.readings["position"]
    good = np.isfinite(position)
    index = np.arange(len(position))
    filled = np.interp(index, index[good], position[good])
    width = min(max(5, round(smoothing / experiment.period) // 2 * 2 + 1), len(position) // 2)
    width -= 1 - width % 2
    velocity = savgol_filter(filled, max(3, width), 2, deriv=1, delta=experiment.period)
    return np.asarray(np.where(good, velocity, np.nan))


def hydraulic_force(experiment: Experiment, twin: Twin) -> Array:
    """Return A_p (p_a - alpha p_b) from the readings [N]; an absent chamber is at tank pressure."""
    p = twin.plant_values
    tank = np.full(experiment.samples, p.get("tank_pressure", 0.0))
    a = experiment.readings.get("pressure_a", tank)
    b = experiment.readings.get("pressure_b", tank)
    return np.asarray(p["cylinder_piston_area"] * (a - p["cylinder_area_ratio"] * b))


def _correlation(a: Array, b: Array) -> float:
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < 20 or np.std(a[good]) == 0.0 or np.std(b[good]) == 0.0:
        return 0.0
    return float(np.corrcoef(a[good], b[good])[0, 1])


def contradictions(experiments: Sequence[Experiment], twin: Twin) -> list[str]:
    """Return what in driven experiments contradicts the sign convention or the units."""
    found = []
    for e in experiments:
        driven = len(e.current) > 0 and "position" in e.readings
        if driven and _correlation(e.current, speed(e, 0.02)) < CONTRARY:
            found.append(
                f"{e.name}: the rod moves against the valve current; "
                "reverse the sign of position or of valve_current"
            )
        if "load_force" in e.readings and "pressure_a" in e.readings:
            force = hydraulic_force(e, twin)
            if _correlation(force, e.readings["load_force"]) < 2.0 * CONTRARY:
                found.append(
                    f"{e.name}: load force and pressures are opposite; reverse load_force, "
                    "or exchange pressure_a and pressure_b"
                )
    return found


def dissipative(experiments: Sequence[Experiment], twin: Twin) -> list[Experiment]:
    """Return force-balance experiments in which friction takes energy.

    A test machine may count its position the other way round; friction would then drive the rod,
    which is impossible, so the position is reversed and a note says so.
    """
    work = 0.0
    for e in experiments:
        v = speed(e)
        gap = e.readings["load_force"] - hydraulic_force(e, twin)
        good = np.isfinite(v) & np.isfinite(gap)
        v, gap = v[good], gap[good] - np.median(gap[good])
        work += float(np.sum(v * gap)) / max(float(np.sqrt(np.sum(v**2) * np.sum(gap**2))), 1e-30)
    if work <= 0.0:
        return list(experiments)
    return [_reversed(e) for e in experiments]


def _reversed(e: Experiment) -> Experiment:
    position = e.readings["position"]
    note = "position: friction would drive the rod, so position counts against extension; reversed"
    turned = float(np.nanmax(position) + np.nanmin(position)) - position
    return replace(e, readings=e.readings | {"position": turned}, notes=(*e.notes, note))
