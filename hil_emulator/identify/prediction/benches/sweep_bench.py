"""Predictor for slow sweeps of a valve: each row is an equilibrium, independent of its duration.

A port with a metered flow is open, and its pressure is given by the recording; otherwise both ports
are blocked, and their pressures are predicted. A leakage line collects the pilot flow, which would
otherwise be part of the return flow.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil_emulator.identify.measured.experiment import FLOWS, Array, Experiment, Index
from hil_emulator.identify.prediction.benches.force_balance import MeasuredStates
from hil_emulator.identify.prediction.benches.meters import Meter, with_meters
from hil_emulator.identify.prediction.free_terms.balances import (
    FLOW_A,
    FLOW_B,
    LEAKAGE,
    NULL_FLOW,
    SPOOL,
    SUPPLY,
    Balance,
)
from hil_emulator.identify.prediction.free_terms.regressors import Regressors, regressors
from hil_emulator.identify.prediction.model_run.records import Sweep, Unknowns
from hil_emulator.identify.prediction.observer.predictor import FixedCovariance
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.nominal import of_leakage
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.plant.probes import PROBES
from hil_emulator.identify.prediction.residuals.correlation import Noise
from hil_emulator.identify.prediction.residuals.noise import noise_levels, quiet_weights
from hil_emulator.model.equilibrium import SCALES, units_of_states
from hil_emulator.model.stages import friction, late_set_point, pilot, set_point, spool

ROWS = 3000
"""Largest number of rows after averaging: steps of about 0.1 % of the full range."""

PORTS = {"flow_a": "pressure_a", "flow_b": "pressure_b"}
"""Pressure that must be recorded with each metered flow."""

SHOWN = ("pressure_a", "pressure_b", "spool_position")
"""Channels that are predicted in addition to flows."""

METERED = {
    FLOW_A: ("flow_a",), FLOW_B: ("flow_b",), NULL_FLOW: ("supply_flow", "return_flow"),
}  # fmt: skip
"""Channels that measure the flow of a balance directly."""

HIDDEN = (friction.table, "cylinder", "load", "oil")
"""Tables whose effects do not change a valve in equilibrium."""

CORRELATED_SHARE = 0.01
"""Share of a sweep over which its residuals may be correlated (assumed)."""

TAKES_TIME = (set_point, late_set_point, pilot, spool)
"""Stages with dynamic effects only."""

PROBE_STEPS = 10.0
"""Step of a derivative by a term, in typical sizes of its probe (assumed)."""


@dataclass(kw_only=True)
class SweepStates(MeasuredStates):
    """One experiment as rows in equilibrium.

    Attributes:
        data: inputs of each row.
        noise: standard deviation of each channel.
        par: plant parameters when it was frozen.
        chan: transducer parameters when it was frozen.
        responses: derivative of each row's readings by a term, by probe.

    """

    data: Sweep
    noise: Array
    par: Array
    chan: Array
    responses: dict[str, Array]


class SweepBench(FixedCovariance):
    """Computes residuals of a slow sweep, with the interface of `predictor.Predictor`.

    Args:
        model: with the boundary conditions of its bench.
        channels: that are predicted: flows, and pressures of blocked ports.
        given: pressures of the ports with a metered flow.
        correlation_time: over which residuals may be correlated [s].

    """

    measure = "standard deviations of the noise"

    def __init__(
        self, model: PlantModel, channels: tuple[str, ...], given: tuple[str, ...],
        correlation_time: float,
    ) -> None:  # fmt: skip
        metered = [n for n in channels if n in FLOWS]
        self.model, self.channels, self.given = with_meters(model, metered), channels, given
        self._fields = len(model.kernel.channel.names or ())
        self._metering = {n: Meter(self.model, n) for n in metered}
        self.correlation_time = correlation_time
        self._states = list(model.kernel.state.names or ())
        units = units_of_states(model.kernel)
        self._scales = np.array([SCALES.get(units.get(n, ""), 1e-3) for n in self._states])
        self._least = np.array([0.0 if n in SHOWN[:2] else -np.inf for n in self._states])
        at = model.signal_names.index
        self._meters = {
            "flow_a": (at("flow_a"),), "flow_b": (at("flow_b"),),
            "supply_flow": (at("supply_flow"),), "return_flow": (at("tank_flow"),),
            "leakage_line_flow": (at("pilot_flow"), at("outward_flow")),
        }  # fmt: skip
        self._drained = at("pilot_flow")

    @property
    def balances(self) -> tuple[Balance, ...]:
        """Balances whose terms change the channels."""
        balances = [SPOOL]
        balances += [FLOW_A] if {"flow_a", "pressure_a"} & set(self.channels) else []
        balances += [FLOW_B] if {"flow_b", "pressure_b"} & set(self.channels) else []
        balances += [LEAKAGE] if {"pressure_a", "pressure_b"} <= set(self.channels) else []
        balances += [NULL_FLOW] if set(METERED[NULL_FLOW]) & set(self.channels) else []
        return tuple(balances)

    def cost(self, par: Array) -> float:
        """Return 1: all predictions take the same time."""
        return 1.0

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> SweepStates:
        """Convert readings to the inputs of each row."""
        e = experiment
        supply = e.readings.get("supply_pressure", np.full(e.samples, par[self.model.supply]))
        given = np.column_stack(
            [np.zeros((e.samples, 0)), *(_whole(e.readings[n]) for n in self.given)]
        )
        places = np.array([self._states.index(n) for n in self.given], dtype=np.int64)
        data = Sweep(
            e.current, _whole(supply), given, places, np.zeros((e.samples, len(PROBES))), e.period
        )
        measured = e.matrix(self.channels)
        return SweepStates(
            e, self.channels, measured, np.zeros((e.samples, 0)), np.zeros(e.samples),
            np.asarray(np.isfinite(measured).any(axis=1)), np.ones(len(self.channels)), data=data,
            noise=noise_levels(e, self.channels), par=par, chan=chan, responses={},
        )  # fmt: skip

    def innovations(
        self, frozen: SweepStates, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the weighted residuals, shape (samples, channels), and the signals."""
        predicted, path = self._predicted(frozen.data, par, chan)
        return self._residual(frozen, predicted), path

    def _residual(self, frozen: SweepStates, predicted: Array) -> Array:
        return np.asarray(np.nan_to_num(frozen.measured - predicted) * frozen.weights)

    def with_other_sensors(
        self, frozen: SweepStates, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the residuals with other sensors; there are no state corrections."""
        inside, data = slice(len(self.model.sources) * self._fields), frozen.data
        run, rows = self._run(data, par, chan), []
        for other in others:
            changed = not np.array_equal(other[inside], chan[inside], equal_nan=True)
            shown, path = self._run(data, par, other) if changed else run
            rows.append(self._residual(frozen, self._read(data, shown, path, other)))
        return np.stack(rows)

    def _predicted(self, data: Sweep, par: Array, chan: Array) -> tuple[Array, Array]:
        """Return the predicted readings, shape (samples, channels), and the signals."""
        shown, path = self._run(data, par, chan)
        return self._read(data, shown, path, chan), path

    def _run(self, data: Sweep, par: Array, chan: Array) -> tuple[Array, Array]:
        """Return the readings of the model's channels, and its signals."""
        model = self.model
        still = {"position", "velocity", *self.given}
        places: Index = np.array(
            [self._states.index(n) for n in model.active(par) if n not in still], dtype=np.int64
        )
        solved = Unknowns(places, self._scales[places], self._least[places])
        half = 0.5 * float(data.supply[0])
        start = model.start(par, 1e-5, (half, half))
        return model.loops.sweep(model.at(par, chan), data, start, solved, model.probes)

    def _read(self, data: Sweep, shown: Array, path: Array, chan: Array) -> Array:
        """Return the predicted readings from the model's readings and signals."""
        columns = [
            self._metering[n].reading(self._metered(n, path), chan, data.period) if n in FLOWS
            else shown[:, self.model.names.index(n)] for n in self.channels
        ]  # fmt: skip
        return np.column_stack(columns)

    def _metered(self, name: str, path: Array) -> Array:
        """Return the flow through a meter."""
        flow = path[:, self._meters[name]].sum(axis=1)
        if name == "return_flow" and "leakage_line_flow" in self.channels:
            return np.asarray(flow - path[:, self._drained])
        return np.asarray(flow)

    def weigh(self, frozen: SweepStates, par: Array, chan: Array) -> None:
        """Set the weights for residuals of unit variance without missing effects."""
        frozen.weights = np.ones(len(self.channels))
        residual = self.innovations(frozen, par, chan)[0]
        present = np.isfinite(frozen.measured)
        stretch = round(self.correlation_time / frozen.experiment.period)
        frozen.weights = quiet_weights(
            residual, present, frozen.noise, stretch, frozen.experiment.copies
        )

    def noise_estimate(self, frozen: SweepStates) -> None:
        """Return None: each experiment has a noise of its own."""

    def share(self, frozen: SweepStates, noise: Noise) -> None:
        """Do nothing: there is no common noise."""

    def regressors(self, frozen: SweepStates, path: Array) -> Regressors:
        """Return the regressors of free terms."""
        return regressors(path, self.model.signal_names, frozen.experiment.period)

    def _columns_of(self, balance: Balance) -> list[int]:
        """Return the indices of channels that measure the flow of a balance directly."""
        return [i for i, n in enumerate(self.channels) if n in METERED.get(balance, ())]

    def through(self, frozen: SweepStates, balance: Balance, terms: Array) -> Array:
        """Return the change of the residuals by terms."""
        return np.stack([self._through(frozen, balance, term) for term in terms.T])

    def _through(self, frozen: SweepStates, balance: Balance, term: Array) -> Array:
        column = np.zeros(frozen.measured.shape)
        direct = self._columns_of(balance)
        if direct:
            column[:, direct] = -term[:, None]
        else:
            for probe, weight in balance.probes:
                column -= weight * term[:, None] * self._response(frozen, probe)
        column[~np.isfinite(frozen.measured)] = 0.0
        return np.asarray((column * frozen.weights).ravel())

    def _response(self, frozen: SweepStates, probe: str) -> Array:
        """Return the derivative of the readings by a term with the same value in all rows.

        Rows in equilibrium are nearly independent, so that this is also the derivative by a term
        in a single row.
        """
        if probe not in frozen.responses:
            place = [p.name for p in PROBES].index(probe)
            step = PROBE_STEPS * float(self.model.probe_sizes[place])
            predicted = []
            for size in (-step, step):
                terms = frozen.data.terms.copy()
                terms[:, place] = size
                data = frozen.data._replace(terms=terms)
                predicted.append(self._predicted(data, frozen.par, frozen.chan)[0])
            frozen.responses[probe] = np.asarray((predicted[1] - predicted[0]) / (2.0 * step))
        return frozen.responses[probe]


def sweep_bench(
    model: PlantModel, experiments: Sequence[Experiment]
) -> tuple[SweepBench | None, str]:
    """Return the predictor of slow sweeps, or None and the reason.

    Args:
        model: of the actuator.
        experiments: all of them with the same channels.

    """
    shown = set.intersection(*(set(e.readings) for e in experiments))
    given = tuple(p for flow, p in PORTS.items() if flow in shown)
    for e in experiments:
        lacking = [p for p in given if p not in e.readings]
        lacking += [] if len(e.current) else ["valve_current"]
        if lacking:
            return None, f"{e.name} has no {' and no '.join(lacking)}, which a sweep needs"
    channels = [n for n in (*SHOWN, *FLOWS) if n in shown and n not in given]
    if not channels:
        return None, (
            "no channel that a sweep could show: add a flow "
            f"({', '.join(FLOWS)}), or the pressures of blocked ports"
        )
    model = copy.copy(model)
    model.nominal = of_leakage(model.nominal, experiments, model.plant_values)
    shortest = min(e.samples * e.period for e in experiments)
    return SweepBench(model, tuple(channels), given, CORRELATED_SHARE * shortest), ""


def averaged(e: Experiment) -> Experiment:
    """Return an experiment of at most `ROWS` rows, each the mean of several."""
    block = -(-e.samples // ROWS)
    if block == 1:
        return e
    note = f"averaged over {block * e.period:.3g} s each: a slow sweep needs no more rows"
    return replace(
        e, period=block * e.period, current=_means(e.current, block),
        readings={n: _means(v, block) for n, v in e.readings.items()}, notes=(*e.notes, note),
    )  # fmt: skip


def _means(values: Array, block: int) -> Array:
    rows = values[: len(values) // block * block].reshape(-1, block)
    good = np.isfinite(rows)
    count = good.sum(axis=1)
    total = np.where(good, rows, 0.0).sum(axis=1)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _whole(values: Array) -> Array:
    """Return values with gaps interpolated."""
    good = np.isfinite(values)
    index = np.arange(len(values))
    return np.asarray(np.interp(index, index[good], values[good]))


def examinable(candidate: Coordinate, predictor: SweepBench) -> bool:
    """Return whether a static effect changes a slow sweep."""
    effect = candidate.effect
    if effect is None or candidate.channel:
        return candidate.channel in predictor.channels
    if effect.knob.unit == "s":
        return False
    return all(
        law.stage not in TAKES_TIME and law.stage.table not in HIDDEN
        and SUPPLY.name not in law.stage.balances
        for law in effect.laws
    )  # fmt: skip
