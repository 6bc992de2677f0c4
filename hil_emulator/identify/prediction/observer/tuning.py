"""Tuning of the Kalman filter: initial covariance and process noise."""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment, noise_of
from hil_emulator.identify.prediction.model_run.records import Tuning
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.plant.rating import largest_current

NULL_DRIFT = 1e-3
"""Standard deviation of the null drift over the rated current (assumed)."""

NULL_TIME = 4.0
"""Correlation time of the null drift [s] (assumed)."""

SUPPLY_DRIFT = 5e4
"""Largest standard deviation of unmodelled supply pressure [Pa] (assumed)."""

SUPPLY_TIME = 0.02
"""Correlation time of unmodelled supply pressure [s] (assumed: pump ripple of about 10 Hz)."""

FLOW_DISTURBANCE = 5e-4
"""Unmodelled flow over the flow at the largest current (assumed)."""

FORCE_DISTURBANCE = 2e-3
"""Unmodelled force over area times supply pressure (assumed)."""

CREEP = 1e-5
"""Step of the derivative by velocity [m/s] (assumed): within it, friction is nearly linear."""

SLIP = 1e-3
"""Smallest step of a secant by velocity [m/s] (assumed): the uncertainty of the velocity at rest,
over which the slope of friction is far smaller than its tangent."""

FASTEST_SLIP = 1e-2
"""Largest step of a secant by velocity [m/s] (assumed)."""

DISTURBANCE_TIME = 0.01
"""Correlation time of unmodelled flow and force [s] (assumed)."""

EARLIER_COMMAND_TIME = 0.02
"""Time for which set points before the recording may act [s] (assumed)."""


def tuning(
    model: PlantModel, par: Array, names: Sequence[str], start: Array, experiment: Experiment
) -> Tuning:
    """Return the tuning for one experiment.

    Args:
        model: of the actuator.
        par: its parameters.
        names: active states.
        start: their values at the start.
        experiment: the data, for the largest current and the supply ripple.

    """
    top = max(float(np.nanmax(np.abs(experiment.current), initial=0.0)), 1e-6)
    p = dict(zip(model.kernel.parameters.names or (), par.tolist(), strict=True))
    area, supply = p["cylinder_piston_area"], p["supply_pressure"]
    flow = FLOW_DISTURBANCE * p["valve_gain"] * top * np.sqrt(supply / 2.0)
    volume = p["cylinder_dead_volume_a"] + 0.5 * area * p["cylinder_stroke"]
    colour = 2.0 * DISTURBANCE_TIME
    force = FORCE_DISTURBANCE * area * supply / p["load_mass"]
    pressure = p["oil_bulk_modulus"] / volume * flow
    # (initial deviation, diffusion per square root of a second, step of the difference)
    table = {
        "spool_position": (0.01 * top, 0.0, 1e-6),
        "spool_speed": (top, top, 1e-3),
        "pressure_a": (0.2 * supply, pressure * np.sqrt(colour), 1e4),
        "pressure_b": (0.2 * supply, pressure * np.sqrt(colour), 1e4),
        "position": (1e-3, 0.0, 1e-6),
        "velocity": (0.1, force * np.sqrt(colour), CREEP),
        "seal_bend": (1.0, 0.0, 1e-2),
    }
    rows = [table.get(n, (1e-3 * abs(s), 0.0, 1e-4 * max(abs(s), 1e-3)))
            for n, s in zip(names, start, strict=True)]  # fmt: skip
    drift = NULL_DRIFT * max(top, largest_current(p))
    levels = np.array([drift, _supply_drift(experiment)])
    spread = np.array([r[0] for r in rows] + [drift, SUPPLY_DRIFT])
    growth = np.array([r[1] for r in rows]) ** 2 * experiment.period
    diffusion = np.concatenate([growth, levels**2 * (1.0 - decay(experiment.period) ** 2)])
    widths = np.array([r[2] for r in rows] + [1e-6, 1e4])
    settling = round(EARLIER_COMMAND_TIME / experiment.period)
    secant = np.array([SLIP, FASTEST_SLIP])
    return Tuning(np.diag(spread**2), diffusion, widths, secant, settling)


def decay(period: float) -> Array:
    """Return the decay factors of null drift and supply deviation over a period [s]."""
    return np.asarray(np.exp(-period / np.array([NULL_TIME, SUPPLY_TIME])))


def _supply_drift(experiment: Experiment) -> float:
    """Return the standard deviation of the supply pressure in excess of white noise [Pa]."""
    readings = experiment.readings.get("supply_pressure")
    if readings is None:
        return SUPPLY_DRIFT
    noise = noise_of(readings)
    beyond = float(np.nanvar(readings)) - noise**2
    return float(np.clip(np.sqrt(max(beyond, 0.0)), 0.03 * noise + 1.0, SUPPLY_DRIFT))
