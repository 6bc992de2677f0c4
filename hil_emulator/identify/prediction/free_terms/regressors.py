"""Regressors of free terms along a predicted trajectory."""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from hil_emulator.identify.measured.experiment import Array

Regressors = dict[str, Array]
"""Values along a trajectory, by name, each of shape (samples,)."""


@dataclass(frozen=True)
class Trajectory:
    """Signals along a predicted trajectory.

    Attributes:
        signals: values by name.
        period: between samples [s].
        readings: of the sensors, by channel.

    """

    signals: Regressors
    period: float
    readings: Mapping[str, Array] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        """Return the values of a signal."""
        return self.signals[name]

    @property
    def direction(self) -> Array:
        """The sign of the velocity, smoothed at reversals."""
        v = self["velocity"]
        return np.asarray(np.tanh(v / max(0.02 * float(np.max(np.abs(v))), 1e-4)))

    @property
    def drop(self) -> Array:
        """Pressure difference over the piston [Pa]."""
        return np.asarray(self["pressure_a"] - self["pressure_b"])

    @property
    def total(self) -> Array:
        """Sum of both pressures [Pa]."""
        return np.asarray(self["pressure_a"] + self["pressure_b"])

    def rate(self, name: str) -> Array:
        """Return the derivative of a signal by time."""
        return np.asarray(np.gradient(self[name], self.period))

    def latest_rate(self, name: str, order: int = 1) -> Array:
        """Return a backward difference of a reading.

        The prediction of the next sample uses this sample's reading; a difference with the next
        one would be correlated with its noise.
        """
        values = self[name]
        before = np.full(order, values[0])
        return np.asarray(np.diff(values, order, prepend=before) / self.period**order)

    def read(self, channel: str) -> Array:
        """Return the previous reading of a sensor, or its prediction where it is missing.

        Errors of a correct prediction are independent of earlier readings, but not of the
        prediction itself if another sensor has an error.
        """
        values = self[channel].copy()
        if channel in self.readings:
            before = self.readings[channel][:-1]
            values[1:] = np.where(np.isfinite(before), before, values[1:])
        return values

    @property
    def time(self) -> Array:
        """Time since the first sample [s]."""
        return np.arange(len(self["velocity"]), dtype=np.float64) * self.period


@dataclass(frozen=True)
class Regressor:
    """One argument of free terms.

    Attributes:
        name: in words.
        unit: SI unit.
        arguments: names of the arguments of laws that depend on it.
        along: computes it along a trajectory.

    """

    name: str
    unit: str
    arguments: frozenset[str]
    along: Callable[[Trajectory], Array]


def _regressor(
    name: str, unit: str, arguments: str, along: Callable[[Trajectory], Array]
) -> Regressor:
    return Regressor(name, unit, frozenset(arguments.split()), along)


REGRESSORS = {r.name: r for r in (
    _regressor(
        "valve current", "A", "set_point current opening travel", lambda t: t["valve_current"]
    ),
    _regressor(
        "rate of the current", "A/s", "set_point current deviation spool_speed",
        lambda t: t.rate("valve_current"),
    ),
    _regressor("time", "s", "", lambda t: t.time),
    _regressor("spool position", "A", "spool_position travel opening",
               lambda t: t["spool_position"]),
    _regressor("pressure a", "Pa", "pressure", lambda t: t["pressure_a"]),
    _regressor("pressure b", "Pa", "pressure", lambda t: t["pressure_b"]),
    _regressor("rate of pressure a", "Pa/s", "", lambda t: t.latest_rate("pressure_a")),
    _regressor("rate of pressure b", "Pa/s", "", lambda t: t.latest_rate("pressure_b")),
    _regressor("second derivative of pressure a", "Pa/s^2", "",
               lambda t: t.latest_rate("pressure_a", 2)),
    _regressor("second derivative of pressure b", "Pa/s^2", "",
               lambda t: t.latest_rate("pressure_b", 2)),
    _regressor("position", "m", "position", lambda t: t["position"]),
    _regressor("measured pressure a", "Pa", "reading", lambda t: t.read("pressure_a")),
    _regressor("measured pressure b", "Pa", "reading", lambda t: t.read("pressure_b")),
    _regressor("measured position", "m", "reading", lambda t: t.read("position")),
    _regressor("measured force", "N", "reading", lambda t: t.read("load_force")),
    _regressor("pressure difference", "Pa", "pressure_a", lambda t: t.drop),
    _regressor("position times pressure difference", "Pa*m", "pressure_a",
               lambda t: t["position"] * t.drop),
    _regressor("velocity", "m/s", "velocity", lambda t: t["velocity"]),
    _regressor("acceleration", "m/s^2", "", lambda t: t.rate("velocity")),
    _regressor("friction", "N", "", lambda t: t["friction_force"]),
    _regressor("position with the sign of velocity", "m", "position",
               lambda t: t["position"] * t.direction),
    _regressor("pressure difference with the sign of velocity", "Pa", "pressure_a",
               lambda t: np.abs(t.drop) * t.direction),
    _regressor("pressure sum with the sign of velocity", "Pa", "pressure_a",
               lambda t: t.total * t.direction),
    _regressor("pressure sum", "Pa", "", lambda t: t.total),
    _regressor("supply flow", "m^3/s", "flow", lambda t: t["supply_flow"]),
    _regressor("return flow", "m^3/s", "flow", lambda t: t["tank_flow"]),
)}  # fmt: skip
"""All regressors, by name."""


def regressors(
    track: Array, names: Sequence[str], period: float, readings: Mapping[str, Array] | None = None,
    absent: Collection[str] = (),
) -> Regressors:  # fmt: skip
    """Return the regressors along a predicted trajectory that depend on no absent signal.

    Args:
        track: signals, shape (samples, signals).
        names: of the signals.
        period: between samples [s].
        readings: of the sensors, by channel, each of shape (samples,), NaN where missing.
        absent: signals that the bench does not have.

    """
    signals = {name: track[:, i] for i, name in enumerate(names) if name not in absent}
    trajectory = Trajectory(signals, period, readings or {})
    values = {}
    for name, regressor in REGRESSORS.items():
        with suppress(KeyError):
            # a view would keep the whole track
            values[name] = np.ascontiguousarray(regressor.along(trajectory))
    return values
