"""Nonparametric terms: what an effect in no catalogue would look like, and where.

A block is one balance and one driver; six hat functions of the driver are put into the balance
along the filtered trajectory. A block that explains much more than the best catalogued effect says
that the law is another one, or that the effect is unknown.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.twin import Coordinate

if TYPE_CHECKING:
    from hil_emulator.identify.naming.fit import Fitter

HATS = 6
"""Hat functions of a block."""

FINE = 24
"""The same over the place along the stroke: a tight spot is as long as a seal."""

CHANCE = 2.5
"""Gain in chi-square that a hat function may have by chance alone."""

Drivers = dict[str, Array]


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
SUPPLY = Balance("supply pressure", "Pa", 1e5)
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
    (SUPPLY, "supply flow"), (CELL, "time"), (CELL, "pressure sum"), (RULER, "velocity"),
    (RULER, "acceleration"),
)  # fmt: skip
"""Balance and driver of every block. The spool over time is missing: drift of the null, which every
valve has, is a state of the predictor."""


@dataclass(frozen=True)
class BlockScore:
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

    """

    balance: Balance
    driver: str
    statistic: float
    limit: float
    knots: Array
    curve: Array
    columns: Array

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
        """Gain in chi-square beyond what so many hat functions have by chance alone."""
        return self.statistic - CHANCE * len(self.knots)


def drivers(track: Array, names: Sequence[str], period: float) -> Drivers:
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
    }


def hats(values: Array, knots: Array) -> Array:
    """Return hat functions of `values` on `knots`, shape (samples, knots)."""
    clipped = np.clip(values, knots[0], knots[-1])
    return np.column_stack([np.interp(clipped, knots, row) for row in np.eye(len(knots))])


def _knots(values: Array, count: int) -> Array | None:
    """Return knots at the quantiles of a driver; None for one that stands still."""
    spread = np.quantile(values, np.linspace(0.01, 0.99, count))
    if spread[-1] - spread[0] < 1e-12:
        return None
    even = np.linspace(spread[0], spread[-1], count)
    return np.asarray(0.5 * (spread + even))


def score_blocks(
    fitter: "Fitter", coordinates: Sequence[Coordinate], at: Array,
    project: Callable[[Array], Array], residual: Array, seed: int = 0,
) -> list[BlockScore]:  # fmt: skip
    """Return what every block explains, best first.

    Args:
        fitter: with frozen experiments.
        coordinates: what was free.
        at: where it ended.
        project: takes out what the free parameters explain.
        residual: the residual with its prior rows.
        seed: of the random signs that give the limits.

    """
    twin = fitter.predictor.twin
    par, chan = twin.memory(coordinates, at)
    tracks = [fitter.predictor.innovations(f, par, chan, track=True)[1] for f in fitter.frozen]
    predictor = fitter.predictor
    driven = [predictor.drivers(f, t) for f, t in zip(fitter.frozen, tracks, strict=True)]
    wanted = [b for b in BLOCKS if b[0] in predictor.balances]
    found = []
    for balance, driver in wanted:
        count = FINE if balance is PISTON and driver.startswith("position") else HATS
        knots = _knots(np.concatenate([d[driver] for d in driven]), count)
        if knots is None:
            continue
        terms = [hats(d[driver], knots) for d in driven]
        columns = np.column_stack([_column(fitter, balance, terms, i) for i in range(count)])
        found.append(
            _score(balance, driver, knots, columns, project, residual, seed, fitter.stretch)
        )
    found.sort(key=lambda b: b.limit - b.statistic)
    best = next((b for b in found if not b.balance.channel), None)
    # columns of a long recording are large
    return [b if b.significant or b is best else replace(b, columns=b.columns[:, :0].copy())
            for b in found]  # fmt: skip


def _column(fitter: "Fitter", balance: Balance, terms: Sequence[Array], hat: int) -> Array:
    parts = [
        fitter.predictor.through(frozen, balance, term[:, hat] * balance.scale)
        for frozen, term in zip(fitter.frozen, terms, strict=True)
    ]
    return np.concatenate(parts)


def _score(
    balance: Balance, driver: str, knots: Array, columns: Array,
    project: Callable[[Array], Array], residual: Array,
    seed: int,
    stretch: int,
) -> BlockScore:  # fmt: skip
    projected = np.column_stack([project(c) for c in columns.T])
    values, vectors = np.linalg.eigh(projected.T @ projected)
    keep = values > 1e-4 * max(values[-1], 1e-30)
    basis = projected @ (vectors[:, keep] / np.sqrt(values[keep]))
    gain = basis.T @ residual
    curve = -(vectors[:, keep] / np.sqrt(values[keep])) @ gain * balance.scale
    statistic = float(gain @ gain)
    # what the term explains is no measure of chance
    limit = chance(basis, residual - basis @ gain, seed, 2 * stretch)
    return BlockScore(balance, driver, statistic, limit, knots, curve, columns.astype(np.float32))


def chance(basis: Array, residual: Array, seed: int, length: int) -> float:
    """Return the statistic that residuals without any effect reach in one of ten thousand.

    Whole stretches of the residual get random signs, which keeps their serial correlation.
    """
    rows = len(residual) // length * length
    if rows < 4 * length:
        return float("inf")
    parts = np.einsum(
        "blk,bl->bk", basis[:rows].reshape(-1, length, basis.shape[1]),
        residual[:rows].reshape(-1, length),
    )  # fmt: skip
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(400, len(parts)))
    sums = np.sum((signs @ parts) ** 2, axis=1)
    # a gamma law through mean and variance reaches further than 400 draws
    mean, variance = float(np.mean(sums)), float(np.var(sums))
    return mean + 7.5 * float(np.sqrt(variance)) + 10.0
