"""Predictor for a valve with a flow meter: current, port pressures and the flow through port a.

The model's spool follows the recorded current; the pressures at its metering edges are those
recorded. The rod is locked, and the chambers are too large for the flow to change their pressure.
"""

from collections.abc import Sequence

import numpy as np

from hil_emulator.identify.measured.experiment import FLOW, Array, Experiment
from hil_emulator.identify.prediction.benches.boundary import OPEN_PORTS, with_values
from hil_emulator.identify.prediction.benches.force_balance import MeasuredStates
from hil_emulator.identify.prediction.benches.meters import Meter, with_meters
from hil_emulator.identify.prediction.free_terms.balances import FLOW_A, Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors, regressors
from hil_emulator.identify.prediction.model_run.run import INPUT_COUNT
from hil_emulator.identify.prediction.observer.predictor import FixedCovariance
from hil_emulator.identify.prediction.plant.coordinate import Coordinate
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.residuals.correlation import Noise
from hil_emulator.identify.prediction.residuals.noise import noise_levels, quiet_weights
from hil_emulator.model.stages import SAMPLED, friction, inertia, stop

SPOOL_STEP = 1e-4
"""Integration step [s]; only the spool moves (250 Hz, damped)."""

BENCH_CORRELATION_TIME = 0.2
"""Time over which residuals may be correlated [s] (assumed: null drift)."""

SPOOL_SETTLING = 0.05
"""Excluded time at the start of an experiment, for transients of the spool [s]."""

HIDDEN = ("cross_leakage", "outward_leakage", "oil", "coupling", "play", "load", "load_inertia")
"""Stages whose effects do not change the flow at given pressures."""


class FlowBench(FixedCovariance):
    """Computes the residual of a flow, with the interface of `predictor.Predictor`.

    Args:
        model: of the whole actuator; not modified.

    """

    measure = "m^3/s"
    balances: tuple[Balance, ...] = (FLOW_A,)

    def __init__(self, model: PlantModel) -> None:
        self.model = with_meters(with_values(model, OPEN_PORTS), (FLOW,))
        self._meter = Meter(self.model, FLOW)
        self.channels: tuple[str, ...] = (FLOW,)
        states, self._flow = list(model.kernel.state.names or ()), model.signal_names.index(FLOW)
        self._ports = [states.index(name) for name in ("pressure_a", "pressure_b")]

    @property
    def correlation_time(self) -> float:
        """Time over which residuals may be correlated [s]."""
        return BENCH_CORRELATION_TIME

    def cost(self, par: Array) -> float:
        """Return 1: all predictions take the same time."""
        return 1.0

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> MeasuredStates:
        """Convert readings to port pressures."""
        states = np.tile(self.model.start(par, SPOOL_STEP, None), (experiment.samples, 1))
        present = np.isfinite(experiment.readings[FLOW])
        for place, name in zip(self._ports, ("pressure_a", "pressure_b"), strict=True):
            if name in experiment.readings:
                values = experiment.readings[name]
                good = np.isfinite(values)
                index = np.arange(len(values))
                states[:, place] = np.interp(index, index[good], values[good])
                present &= good
        present[: round(SPOOL_SETTLING / experiment.period)] = False
        measured = experiment.matrix(self.channels)
        return MeasuredStates(
            experiment, self.channels, measured, states, np.zeros(len(states)), present, np.ones(1)
        )

    def innovations(
        self, frozen: MeasuredStates, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return the weighted residual of the flow, shape (samples, 1), and the signals."""
        path = self._path(frozen, par.copy())
        return self._residual(frozen, path, chan), path

    def _residual(self, frozen: MeasuredStates, path: Array, chan: Array) -> Array:
        shown = self._meter.reading(path[:, self._flow], chan, frozen.experiment.period)
        residual = np.where(frozen.present, frozen.measured[:, 0] - shown, 0.0)
        return np.asarray(residual[:, None] * frozen.weights)

    def with_other_sensors(
        self, frozen: MeasuredStates, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the residuals with other sensors; there are no state corrections."""
        path = self._path(frozen, par.copy())
        return np.stack([self._residual(frozen, path, other) for other in others])

    def _path(self, frozen: MeasuredStates, par: Array) -> Array:
        """Return the model's signals along the recorded current and pressures."""
        model, e = self.model, frozen.experiment
        tick = model.kernel.tick
        supply = e.readings.get("supply_pressure", np.full(e.samples, par[model.supply]))
        supply = np.where(np.isfinite(supply), supply, par[model.supply])
        memory = frozen.states[0].copy()
        past, inputs = np.full(model.remembered[0], np.nan), np.zeros(INPUT_COUNT)
        signals = np.zeros(len(model.signal_names))
        path = np.zeros((e.samples, len(signals)))
        steps = max(1, int(np.ceil(e.period / SPOOL_STEP - 1e-9)))
        met = np.empty((steps, len(model.names)))
        for k in range(e.samples):
            memory[self._ports] = frozen.states[k, self._ports]
            par[model.supply] = supply[k]
            inputs[0] = e.current[max(0, k - 1)]
            tick(memory, past, par, inputs, signals, met, e.period / steps, steps if k else 0)
            path[k] = signals
        return path

    def weigh(self, frozen: MeasuredStates, par: Array, chan: Array) -> None:
        """Set the weights for residuals of unit variance without missing effects."""
        frozen.weights = np.ones(1)
        residual = self.innovations(frozen, par, chan)[0]
        noise = noise_levels(frozen.experiment, self.channels)
        present = frozen.present[:, None]
        stretch = round(BENCH_CORRELATION_TIME / frozen.experiment.period)
        frozen.weights = quiet_weights(residual, present, noise, stretch, frozen.experiment.copies)

    def noise_estimate(self, frozen: MeasuredStates) -> None:
        """Return None: each experiment has a noise of its own."""

    def share(self, frozen: MeasuredStates, noise: Noise) -> None:
        """Do nothing: there is no common noise."""

    def regressors(self, frozen: MeasuredStates, path: Array) -> Regressors:
        """Return the regressors of free terms."""
        return regressors(path, self.model.signal_names, frozen.experiment.period)

    def through(self, frozen: MeasuredStates, balance: Balance, terms: Array) -> Array:
        """Return the change of the residual by terms."""
        return np.asarray(np.where(frozen.present, -terms.T, 0.0) * frozen.weights[0])


def flow_bench(
    model: PlantModel, experiments: Sequence[Experiment]
) -> tuple[FlowBench | None, str]:
    """Return the predictor of a measured flow, or None and the reason.

    Args:
        model: of the actuator.
        experiments: at least one of them has the flow.

    """
    for e in experiments:
        lacking = [n for n in (FLOW, "pressure_a") if n not in e.readings]
        if not len(e.current) or np.ptp(e.current) == 0.0:
            lacking.append("valve_current")
        if lacking:
            return None, f"{e.name} has {FLOW} without {', '.join(lacking)}" if (
                FLOW in e.readings
            ) else f"{e.name} has no {FLOW}, which others have"
    return FlowBench(model), ""


def examinable(candidate: Coordinate) -> bool:
    """Return whether an effect changes the flow at given pressures."""
    effect = candidate.effect
    if effect is None or candidate.channel:
        return candidate.channel == FLOW
    hidden = (*SAMPLED, inertia, stop)
    return all(
        law.stage not in hidden and law.stage.table != friction.table
        and law.stage.name not in HIDDEN
        for law in effect.laws
    )  # fmt: skip
