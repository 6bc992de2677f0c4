"""Predictor for a valve alone: its current with the spool position or with blocked port pressures.

The rod is locked, and the chambers are closed volumes at the configured position. Effects of
friction, load and motion are not observable.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import savgol_filter

from hil_emulator.identify.measured.experiment import SPANS, Array, Experiment
from hil_emulator.identify.prediction.benches.boundary import LOCKED, with_values
from hil_emulator.identify.prediction.benches.edge_flow import through_edge
from hil_emulator.identify.prediction.free_terms.balances import (
    FLOW_A,
    FLOW_B,
    LEAKAGE,
    SPOOL,
    SUPPLY,
    Balance,
)
from hil_emulator.identify.prediction.observer.observer import Observer
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.model.sensors import CHANNELS

CHANNELS_OF_A_VALVE = ("pressure_a", "pressure_b", "supply_pressure", "spool_position")

CLOSED_CORRELATION = 0.5
"""Correlation of pressure rate and valve flow above which a volume counts as closed."""

DEAD_BANDS = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Quantiles of the current as dead bands of the valve; the one with the best correlation is
used."""

VOLUME_RATIO = 5.0
"""Largest ratio, either way, of a closed volume to the configured one."""

PRESSURE_RATE_WINDOW = 5e-3
"""Window of the derivative of a pressure [s]."""


class ValveBench(Observer):
    """Predicts spool and closed chambers; the interface of `observer.Observer`.

    Args:
        model: of the whole actuator; not modified.
        channels: those of `CHANNELS_OF_A_VALVE` that every experiment has.

    """

    def __init__(self, model: PlantModel, channels: tuple[str, ...]) -> None:
        super().__init__(with_values(model, {"load_mass": LOCKED}), channels)

    @property
    def balances(self) -> tuple[Balance, ...]:
        """Balances whose terms change the channels."""
        balances = [SPOOL]
        if "pressure_a" in self.channels:
            balances.append(FLOW_A)
        if "pressure_b" in self.channels:
            balances.append(FLOW_B)
        if {"pressure_a", "pressure_b"} <= set(self.channels):
            balances.append(LEAKAGE)
        if "supply_pressure" in self.channels and len(balances) > 1:
            balances.append(SUPPLY)
        return tuple(balances)


def bench(model: PlantModel, experiments: Sequence[Experiment]) -> tuple[ValveBench | None, str]:
    """Return the predictor of experiments without a motion, or None and the reason.

    Args:
        model: of the actuator.
        experiments: without a moving position.

    """
    names = tuple(
        c.name for c in CHANNELS
        if c.name in CHANNELS_OF_A_VALVE and all(c.name in e.readings for e in experiments)
    )  # fmt: skip
    shows = [n for n in names if n != "supply_pressure"]
    if not shows or not all(len(e.current) and np.ptp(e.current) > 0.0 for e in experiments):
        return None, "no valve_current with the spool's position or with chamber pressures either"
    for e in experiments:
        for name in ("pressure_a", "pressure_b"):
            if name in names and not _closed(e, name, model):
                return None, (
                    f"{e.name}: nor does {name} follow the valve as in a closed volume of the "
                    "configured size, which a rod at rest or blocked ports would give"
                )
    return ValveBench(model, names), ""


def _closed(e: Experiment, name: str, model: PlantModel) -> bool:
    """Return whether a pressure changes by the valve's flow into a closed volume."""
    p = model.plant_values
    pressure = e.readings[name]
    good = np.isfinite(pressure)
    index = np.arange(len(pressure))
    filled = np.interp(index, index[good], pressure[good])
    width = max(5, round(PRESSURE_RATE_WINDOW / e.period) // 2 * 2 + 1)
    rate = savgol_filter(filled, width, 2, deriv=1, delta=e.period)
    side = "a" if name == "pressure_a" else "b"
    current = e.current if side == "a" else -e.current
    inside = p["initial_position"] if side == "a" else p["cylinder_stroke"] - p["initial_position"]
    area = p["cylinder_piston_area"] * (1.0 if side == "a" else p["cylinder_area_ratio"])
    volume = p[f"cylinder_dead_volume_{side}"] + area * inside
    still = float(np.ptp(filled)) < 1e-3 * SPANS[name]
    best, ratio = 0.0, 0.0
    for dead in np.quantile(np.abs(current), DEAD_BANDS):
        flow = savgol_filter(_into(_beyond(current, dead), filled, e, p), width, 2)
        if np.std(flow) > 0.0 and (correlation := float(np.corrcoef(flow, rate)[0, 1])) > best:
            best, ratio = correlation, float(np.std(rate) / np.std(flow))
    ratio *= volume / p["oil_bulk_modulus"]
    return not still and best > CLOSED_CORRELATION and 1.0 / VOLUME_RATIO < ratio < VOLUME_RATIO


def _beyond(current: Array, dead: float) -> Array:
    """Return a current with a dead band subtracted."""
    return np.asarray(np.sign(current) * np.maximum(np.abs(current) - dead, 0.0))


def _into(current: Array, pressure: Array, e: Experiment, p: dict[str, float]) -> Array:
    """Return the flow of the configured valve into a chamber [m^3/s]."""
    supply = e.readings.get("supply_pressure", np.full(e.samples, p["supply_pressure"]))
    drop = np.where(current > 0.0, supply - pressure, pressure - p["tank_pressure"])
    flow = through_edge(np.abs(current), np.maximum(np.nan_to_num(drop), 0.0), p)
    return np.asarray(np.sign(current) * flow)
