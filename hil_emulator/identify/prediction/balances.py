"""Nonparametric terms: what an effect in no catalogue would look like, and where.

A block is one balance and one driver; six hat functions of the driver are put into the balance
along the filtered trajectory. A block that explains much more than the best catalogued effect says
that the law is another one, or that the effect is unknown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hil_emulator.identify.measured.experiment import Array

HATS = 6
"""Hat functions of a block."""

FINE = 24
"""The same over the place along the stroke: a tight spot is as long as a seal."""

Regressors = dict[str, Array]


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

BLOCKS: tuple[tuple[Balance, str], ...] = (
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
"""Balance and driver of every block. The spool over time is missing: drift of the null, which every
valve has, is a state of the predictor."""


@dataclass(frozen=True)
class DiscrepancyTerm:
    """What one block explains.

    Attributes:
        balance: where the term sits.
        driver: what it depends on.
        statistic: gain in chi-square.
        limit: what chance reaches in one of ten thousand, residuals serially correlated.
        knots: values of the driver.
        curve: the term there, in the balance's unit.
        columns: derivative of the residual by each hat; none of a term that is not significant, but
            for the best of those that are no error of a sensor.
        doubt: standard deviation that each free parameter gets from a term of this strength and
            unknown shape.
        usual: what chance reaches on average.

    """

    balance: Balance
    driver: str
    statistic: float
    limit: float
    knots: Array
    curve: Array
    columns: Array
    doubt: Array = field(default_factory=lambda: np.zeros(0))
    usual: float = 0.0

    @property
    def title(self) -> str:
        """The balance and its driver in words."""
        return f"{self.balance.name} over {self.driver}"

    @property
    def significant(self) -> bool:
        """Whether chance hardly explains it."""
        return self.statistic > self.limit

    @property
    def surplus(self) -> float:
        """Gain in chi-square beyond what the term has by chance on average."""
        return self.statistic - self.usual

    @property
    def certain(self) -> float:
        """Gain in chi-square beyond what chance hardly ever reaches."""
        return self.statistic - self.limit


def drivers(track: Array, names: Sequence[str], period: float) -> Regressors:
    """Return the drivers along a predicted trajectory."""
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
