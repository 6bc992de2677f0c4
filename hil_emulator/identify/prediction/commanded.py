"""What a proportional position loop commands, where its reference was recorded and no current."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import savgol_filter

from hil_emulator.identify.measured.experiment import REFERENCE, Array, Experiment

RATE_WINDOW = 0.02
"""Time over which velocity and rate of pressure are fitted [s] (assumed)."""

LARGE = 0.5
"""Quantile of the control deviation from which a dead band no longer bends the flow (assumed)."""


def commanded(e: Experiment, gain: float) -> Experiment:
    """Return an experiment with the current that its loop commands.

    Args:
        e: with position and its reference.
        gain: proportional gain [A/m].

    """
    readings = {n: v for n, v in e.readings.items() if n != REFERENCE}
    current = gain * _deviation(e)
    return replace(e, current=current, set_point_first=False, readings=readings)


def in_loop(e: Experiment) -> bool:
    """Whether an experiment tells its reference and no current."""
    return {REFERENCE, "position"} <= set(e.readings) and not len(e.current)


def found_gain(experiments: Sequence[Experiment], plant: Mapping[str, float]) -> float:
    """Return the gain with which the configured valve gives the flow into chamber a [A/m].

    A v + (V/beta) dp/dt = K_v (k e - c sign(e)) sqrt(dp), by least squares where the deviation e is
    large: c takes a dead band. An error of K_v goes into k, and their product is right.

    Args:
        experiments: of one loop, see `in_loop`.
        plant: parameters of the plant by record field, SI.

    """
    equations = [_equations(e, plant) for e in experiments]
    columns = np.concatenate([c for c, _ in equations])
    scales = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    flow = np.concatenate([f for _, f in equations])
    return float((np.linalg.lstsq(columns / scales, flow, rcond=None)[0] / scales)[0])


def _equations(e: Experiment, plant: Mapping[str, float]) -> tuple[Array, Array]:
    """Return the columns of k and c, and the flow, where the deviation is large."""
    position, deviation = e.readings["position"], _deviation(e)
    pressure = e.readings.get("pressure_a", np.full(e.samples, 0.5 * plant["supply_pressure"]))
    area = plant["cylinder_piston_area"]
    stiffness = plant["oil_bulk_modulus"] / (plant["cylinder_dead_volume_a"] + area * position)
    flow = area * _rate(position, e.period) + _rate(pressure, e.period) / stiffness
    supply = e.readings.get("supply_pressure", np.full(e.samples, plant["supply_pressure"]))
    drop = np.where(deviation > 0.0, supply - pressure, pressure - plant["tank_pressure"])
    size = plant["valve_gain"] * np.sqrt(np.maximum(drop, 0.0))
    large = np.abs(deviation) > np.quantile(np.abs(deviation), LARGE)
    large &= np.isfinite(flow) & np.isfinite(size)
    return np.column_stack([size * deviation, -size * np.sign(deviation)])[large], flow[large]


def _deviation(e: Experiment) -> Array:
    return np.asarray(np.nan_to_num(e.readings[REFERENCE] - e.readings["position"]))


def _rate(values: Array, period: float) -> Array:
    width = max(5, round(RATE_WINDOW / period) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, width, 2, deriv=1, delta=period))
