"""Current of a proportional position loop, for logs with its reference but without a current."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from hil_emulator.identify.measured.experiment import REFERENCE, Array, Experiment
from hil_emulator.identify.prediction.benches.edge_flow import through_edge

RATE_WINDOW = 0.02
"""Window of the derivatives of position and pressure [s] (assumed)."""

LARGE = 0.5
"""Quantile of the control deviation above which samples are used (assumed)."""

USUAL_DEAD_BAND = 1e-4
"""Typical dead band, as the scale of the fit [A] (assumed)."""


class Metered(NamedTuple):
    """Samples of a loop with a large control deviation.

    Attributes:
        deviation: absolute control deviation [m].
        drop: pressure drop over the open edge of chamber a [Pa].
        flow: through that edge, positive in the direction of the deviation [m^3/s].

    """

    deviation: Array
    drop: Array
    flow: Array


def commanded(e: Experiment, gain: float) -> Experiment:
    """Return an experiment with the current that its loop commanded.

    Args:
        e: with position and its reference.
        gain: proportional gain [A/m].

    """
    readings = {n: v for n, v in e.readings.items() if n != REFERENCE}
    current = gain * _deviation(e)
    return replace(e, current=current, set_point_first=False, readings=readings)


def in_loop(e: Experiment) -> bool:
    """Return whether an experiment has reference and position but no current."""
    return {REFERENCE, "position"} <= set(e.readings) and not len(e.current)


def estimated_gain(experiments: Sequence[Experiment], plant: Mapping[str, float]) -> float:
    """Return the loop gain for which the configured valve gives the flow into chamber a [A/m].

    Least squares fit of A v + (V/beta) dp/dt = q(k |e| - c, dp) with the flow q through an edge and
    a dead band c. An error of the valve gain is compensated by k.

    Args:
        experiments: of one loop, see `in_loop`.
        plant: parameters of the plant by record field, SI.

    """
    every = [_metered(e, plant) for e in experiments]
    deviation, drop, flow = (np.concatenate(c) for c in zip(*every, strict=True))
    scale = max(float(np.std(flow)), 1e-300)
    # order of magnitude, from the mean flow at half of the supply pressure
    usual: float = plant["valve_gain"] * np.sqrt(0.5 * plant["supply_pressure"])
    first = abs(float(np.mean(flow))) / max(usual * float(np.mean(deviation)), 1e-300)

    def errors(at: Array) -> Array:
        gain, dead = np.array([first, USUAL_DEAD_BAND]) * at
        return np.asarray((through_edge(gain * deviation - dead, drop, plant) - flow) / scale)

    solution: Array = least_squares(errors, [1.0, 0.0]).x
    return first * float(solution[0])


def _metered(e: Experiment, plant: Mapping[str, float]) -> Metered:
    """Return the flow into chamber a for large deviations."""
    position, deviation = e.readings["position"], _deviation(e)
    pressure = e.readings.get("pressure_a", np.full(e.samples, 0.5 * plant["supply_pressure"]))
    area = plant["cylinder_piston_area"]
    stiffness = plant["oil_bulk_modulus"] / (plant["cylinder_dead_volume_a"] + area * position)
    flow = area * _rate(position, e.period) + _rate(pressure, e.period) / stiffness
    supply = e.readings.get("supply_pressure", np.full(e.samples, plant["supply_pressure"]))
    drop = np.where(deviation > 0.0, supply - pressure, pressure - plant["tank_pressure"])
    large = np.abs(deviation) > np.quantile(np.abs(deviation), LARGE)
    large &= np.isfinite(flow) & np.isfinite(drop)
    return Metered(np.abs(deviation)[large], drop[large], (flow * np.sign(deviation))[large])


def _deviation(e: Experiment) -> Array:
    return np.asarray(np.nan_to_num(e.readings[REFERENCE] - e.readings["position"]))


def _rate(values: Array, period: float) -> Array:
    width = max(5, round(RATE_WINDOW / period) // 2 * 2 + 1)
    return np.asarray(savgol_filter(values, width, 2, deriv=1, delta=period))
