"""A valve alone: its current with its spool, or with the pressures of blocked ports.

The rod does not move, so the model's is locked by a load that nothing can move; the chambers are
then closed volumes at the configured position. Nothing of friction, load or motion can be seen.
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
"""Correlation of pressure rates with flow into a closed volume that tells it is closed."""

DEAD_BANDS = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Quantiles of the current that may be within a dead band of the valve: the likeliest counts."""

VOLUME_RATIO = 5.0
"""Ratio of a closed volume to the configured one beyond which it is none of this machine's."""

PRESSURE_RATE_WINDOW = 5e-3
"""Time over which a rate of pressure is fitted [s]."""


class ValveBench(Observer):
    """Predicts spool and closed chambers; the interface of `observer.Observer`.

    Args:
        model: the model of the whole actuator; it stays as it is.
        channels: those of `CHANNELS_OF_A_VALVE` that every experiment has.

    """

    def __init__(self, model: PlantModel, channels: tuple[str, ...]) -> None:
        super().__init__(with_values(model, {"load_mass": LOCKED}), channels)

    @property
    def balances(self) -> tuple[Balance, ...]:
        """The balances that the channels can show."""
        found = [SPOOL]
        if "pressure_a" in self.channels:
            found.append(FLOW_A)
        if "pressure_b" in self.channels:
            found.append(FLOW_B)
        if {"pressure_a", "pressure_b"} <= set(self.channels):
            found.append(LEAKAGE)
        if "supply_pressure" in self.channels and len(found) > 1:
            found.append(SUPPLY)
        return tuple(found)


def bench(model: PlantModel, experiments: Sequence[Experiment]) -> tuple[ValveBench | None, str]:
    """Return what predicts experiments without a motion, or None and the reason.

    Args:
        model: the model.
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
    """Tell whether a pressure changes by the valve's flow into a closed volume."""
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
    likeness, ratio = 0.0, 0.0
    for dead in np.quantile(np.abs(current), DEAD_BANDS):
        flow = savgol_filter(_into(_beyond(current, dead), filled, e, p), width, 2)
        if np.std(flow) > 0.0 and (like := float(np.corrcoef(flow, rate)[0, 1])) > likeness:
            likeness, ratio = like, float(np.std(rate) / np.std(flow))
    ratio *= volume / p["oil_bulk_modulus"]
    return not still and likeness > CLOSED_CORRELATION and 1.0 / VOLUME_RATIO < ratio < VOLUME_RATIO


def _beyond(current: Array, dead: float) -> Array:
    """Return what a dead band leaves of a current."""
    return np.asarray(np.sign(current) * np.maximum(np.abs(current) - dead, 0.0))


def _into(current: Array, pressure: Array, e: Experiment, p: dict[str, float]) -> Array:
    """Return the flow of the configured valve into a chamber [m^3/s]."""
    supply = e.readings.get("supply_pressure", np.full(e.samples, p["supply_pressure"]))
    drop = np.where(current > 0.0, supply - pressure, pressure - p["tank_pressure"])
    flow = through_edge(np.abs(current), np.maximum(np.nan_to_num(drop), 0.0), p)
    return np.asarray(np.sign(current) * flow)
