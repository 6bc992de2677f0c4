"""The balances of the machine, and what a term that one of them lacks may depend on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array

Regressors = dict[str, Array]
"""Values along a trajectory, by name, each of shape (samples,)."""


@dataclass(frozen=True)
class Balance:
    """An equation into which a term can be put.

    Attributes:
        name: in words.
        unit: unit of the term.
        scale: size of a usual term.
        probes: weight of each probe.
        channel: the sensor channel, where the term is an error of a sensor.

    """

    name: str
    unit: str
    scale: float
    probes: tuple[tuple[str, float], ...] = ()
    channel: str = ""


SPOOL = Balance("spool", "A", 1e-5, (("probe_spool", 1.0),))
FLOW_A = Balance(
    "flow into chamber a", "m^3/s", 1e-7, (("probe_cross", -0.5), ("probe_outward", -0.5))
)
FLOW_B = Balance(
    "flow out of chamber b", "m^3/s", 1e-7, (("probe_cross", -0.5), ("probe_outward", 0.5))
)
LEAKAGE = Balance("leakage from a to b", "m^3/s", 1e-7, (("probe_cross", 1.0),))
PISTON = Balance("force on the piston", "N", 10.0, (("probe_friction", 1.0),))
LOAD = Balance("force on the load", "N", 10.0, (("probe_load", 1.0),))
RETURN = Balance("return pressure", "Pa", 1e4, (("probe_return", 1.0),))
SUPPLY = Balance("supply pressure", "Pa", 1e5)
TAP_A = Balance("reading of the sensor of pressure a", "Pa", 1e4, channel="pressure_a")
TAP_B = Balance("reading of the sensor of pressure b", "Pa", 1e4, channel="pressure_b")
CELL = Balance("reading of the load cell", "N", 10.0, channel="load_force")
RULER = Balance("reading of the position sensor", "m", 1e-5, channel="position")

TERMS: tuple[tuple[Balance, str], ...] = (
    (SPOOL, "valve current"), (SPOOL, "rate of the current"),
    (FLOW_A, "spool position"), (FLOW_A, "pressure a"), (FLOW_A, "position"),
    (FLOW_B, "spool position"), (FLOW_B, "pressure b"), (FLOW_B, "position"),
    (LEAKAGE, "pressure difference"), (LEAKAGE, "position times pressure difference"),
    (PISTON, "velocity"), (PISTON, "position"), (PISTON, "position with the sign of velocity"),
    (PISTON, "pressure difference with the sign of velocity"),
    (PISTON, "pressure sum with the sign of velocity"), (PISTON, "time"),
    (LOAD, "velocity"), (LOAD, "position"), (LOAD, "time"),
    (SUPPLY, "supply flow"), (RETURN, "return flow"), (TAP_A, "time"), (TAP_B, "time"),
    (CELL, "time"), (CELL, "pressure sum"),
    (RULER, "velocity"), (RULER, "acceleration"),
)  # fmt: skip
"""Balance and regressor of every discrepancy term. The spool over time is missing: drift of the
null, which every valve has, is a state of the predictor."""


def regressors(track: Array, names: Sequence[str], period: float) -> Regressors:
    """Return the regressors along a predicted trajectory."""
    get = {name: track[:, i] for i, name in enumerate(names)}
    v, x = get["velocity"], get["position"]
    sign = np.tanh(v / max(0.02 * float(np.max(np.abs(v))), 1e-4))
    drop = get["pressure_a"] - get["pressure_b"]
    return {
        "valve current": get["valve_current"],
        "rate of the current": np.asarray(np.gradient(get["valve_current"], period)),
        "time": np.arange(len(track), dtype=np.float64) * period,
        "spool position": get["spool_position"],
        "pressure a": get["pressure_a"],
        "pressure b": get["pressure_b"],
        "position": x,
        "pressure difference": drop,
        "position times pressure difference": np.asarray(x * drop),
        "velocity": v,
        "acceleration": np.asarray(np.gradient(v, period)),
        "position with the sign of velocity": x * sign,
        "pressure difference with the sign of velocity": np.abs(drop) * sign,
        "pressure sum with the sign of velocity": (get["pressure_a"] + get["pressure_b"]) * sign,
        "pressure sum": get["pressure_a"] + get["pressure_b"],
        "supply flow": get["supply_flow"],
        "return flow": get["tank_flow"],
    }
