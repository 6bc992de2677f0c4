"""Predictor of a complete actuator: Kalman gains frozen at one point, innovations at any other."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar
from weakref import WeakValueDictionary

import numpy as np

from hil_emulator.identify.measured.experiment import Array, BetweenRows, Experiment, Mask, Single
from hil_emulator.identify.prediction.filter.sensor_replay import NOT_RECORDED, sensor_inputs
from hil_emulator.identify.prediction.free_terms.balances import SUPPLY, TERMS, Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors, regressors
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Entries,
    Gains,
    ParametrisedModel,
    SensorInputs,
    Start,
)
from hil_emulator.identify.prediction.observer.frozen_experiment import Frozen
from hil_emulator.identify.prediction.observer.integration_steps import (
    CAREFUL_STEP,
    LARGEST_STEP,
    IntegrationSteps,
)
from hil_emulator.identify.prediction.observer.tuning import decay, tuning
from hil_emulator.identify.prediction.plant.plant_model import PlantModel
from hil_emulator.identify.prediction.plant.probes import PROBES
from hil_emulator.identify.prediction.residuals.correlation import Noise
from hil_emulator.identify.prediction.residuals.noise import noise_levels, quiet_rms
from hil_emulator.model.sensors import wiring

INNOVATION_CORRELATION_TIME = 0.1
"""Smallest assumed correlation time of innovations [s] (assumed)."""

RECENT = 4
"""Number of points whose innovations are cached."""

BURN_IN = 0.05
"""Excluded time at the start and after a jump of the current, while the states settle [s]."""

LONGEST_PART = 1e-3
"""Longest part of a sample period with one linearisation [s]: a fast spool opens an edge in it."""

Columns = TypeVar("Columns", Array, Single)

_INDEX = {probe.name: i for i, probe in enumerate(PROBES)}


class Observer:
    """Computes Kalman gains and innovations of a complete actuator.

    Args:
        model: of the actuator.
        channels: measured channels.
        step: largest integration step [s]; smaller for a machine with fast dynamics.

    """

    measure = "standard deviations of the noise"
    absent: frozenset[str] = frozenset()
    later: frozenset[str] = frozenset()

    def __init__(
        self, model: PlantModel, channels: tuple[str, ...], step: float = LARGEST_STEP
    ) -> None:
        self.model = model
        self.channels = channels
        self.steps = IntegrationSteps(model, step)
        self.chosen = np.array([model.names.index(c) for c in channels])
        self._living: WeakValueDictionary[tuple[int, bytes], Frozen] = WeakValueDictionary()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the cache of frozen experiments."""
        return {**self.__dict__, "_living": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the state with an empty cache."""
        self.__dict__.update(state, _living=WeakValueDictionary())

    @property
    def correlation_time(self) -> float:
        """Smallest correlation time of innovations [s]."""
        return INNOVATION_CORRELATION_TIME

    def cost(self, par: Array) -> float:
        """Return the time of a prediction over that with `CAREFUL_STEP`."""
        return CAREFUL_STEP / self.steps.width(par)

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> Frozen:
        """Run the extended Kalman filter at given parameters and return its gains.

        A result for the same point that is still in use is returned again.
        """
        point = id(experiment), par.tobytes() + chan.tobytes()
        cached = self._living.get(point)
        if cached is not None and cached.experiment is experiment:
            return replace(cached, weights=np.ones(len(self.channels)))
        frozen = self._living[point] = self._linearised(experiment, par, chan)
        return frozen

    def _linearised(self, experiment: Experiment, par: Array, chan: Array) -> Frozen:
        measured = experiment.matrix(self.channels)
        noise = noise_levels(experiment, self.channels)
        names = list(self.model.kernel.state.names or ())
        active_names = self.model.active(par)
        active = np.array([names.index(n) for n in active_names])
        state, period = self._start(par, measured), experiment.period
        course = experiment.currents
        current = _divided(course.current, period)
        z = np.concatenate([state[active], [0.0, 0.0]])
        start = Start(state, z, active, decay(period / current.shape[1]))
        data = Data(
            current, course.unknown, measured, self.chosen, period,
            _settling(course, round(BURN_IN / period)),
        )  # fmt: skip
        tuned = tuning(self.model, par, active_names, state[active], experiment)
        count, n, m = len(measured), len(z), len(self.chosen)
        gains = Gains(np.empty((count, n, m), np.float32), np.empty((count, m, m), np.float32))
        predicted, model = np.empty((count, n)), self.at(par, chan, data)
        jacobians = self.model.loops.linearise(
            model, data, start, tuned, noise**2, gains, predicted, np.zeros(0, np.int64)
        )
        return Frozen(
            experiment, self.channels, data, start, gains, jacobians, predicted, noise,
            tuned, par, chan, np.ones(len(self.channels)),
        )  # fmt: skip

    def probed(self, frozen: Frozen) -> Entries:
        """Return the derivatives of the next z and reading by each probe."""
        if frozen.probed is None:
            # integrations for the acting effects only do not include the probes
            model = self.at(frozen.par, frozen.chan, frozen.data, every_signal=True)
            tuned = frozen.tuning
            widths = np.concatenate([tuned.widths, self.model.probe_sizes])
            jacobians = self.model.loops.linearise(
                model, frozen.data, frozen.start, tuned._replace(widths=widths), frozen.noise**2,
                frozen.gains, np.empty((0, len(tuned.covariance))), self.model.probes,
            )  # fmt: skip
            frozen.probed = Entries(*jacobians)
        return frozen.probed

    def at(
        self, par: Array, chan: Array, data: Data, every_signal: bool = False
    ) -> ParametrisedModel:
        """Return the model at given parameters, with a stable integration step.

        Args:
            par: parameters of the plant.
            chan: parameters of the transducers.
            data: for one run along them.
            every_signal: whether all signals are needed, not only those of the sensors.

        """
        period = data.period / data.current.shape[1]
        steps = max(1, int(np.ceil(period / self.steps.width(par) - 1e-9)))
        ticks = self.model.loops.ticks
        tick = ticks.whole if every_signal else ticks.at(par, steps * data.current.size)
        return self.model.at(par, chan, period / steps, steps, tick)

    def innovations(
        self, frozen: Frozen, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return weighted whitened innovations, and with `track` the predicted signals."""
        data, recent, point = frozen.data, frozen.recent, par.tobytes() + chan.tobytes()
        path = np.empty((len(data.measured) if track else 1, len(self.model.signal_names)))
        if point in recent and not track:
            return recent[point] * frozen.weights, path
        residual = np.empty_like(data.measured)
        model = self.at(par, chan, data, every_signal=track)
        self.model.loops.predict(
            model, data, frozen.start, frozen.gains, residual, path, NOT_RECORDED
        )
        residual[data.settling] = 0.0
        # replaced by a single assignment, since other threads use it too
        frozen.recent = dict([*recent.items(), (point, residual)][-RECENT:])
        return residual * frozen.weights, path

    def with_other_sensors(
        self, frozen: Frozen, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the weighted innovations of a plant with other sensors, linearised along its run.

        The readings of each set of sensors are exact; their influence on the run is linearised.
        """
        inputs, base = self._sensor_run(frozen, par, chan)
        data = frozen.data
        changes = np.empty((*data.measured.shape, len(others)))
        change = np.empty_like(data.measured)
        for i, other in enumerate(others):
            self.model.loops.reread(self.at(par, other, data), data, inputs, change)
            changes[:, :, i] = change
        no_entry = Entries(np.zeros((0, 0), np.float32), np.zeros((0, 0), np.float32))
        columns = self._propagated(frozen, no_entry, np.zeros((0, len(others))), changes)
        return np.asarray((base + columns) * frozen.weights)

    def _sensor_run(self, frozen: Frozen, par: Array, chan: Array) -> tuple[SensorInputs, Array]:
        """Return the inputs of the sensors at a point, and the whitened innovations."""
        kept, point = frozen.sensor_run, par.tobytes() + chan.tobytes()
        if kept is None or kept[0] != point:
            model, data = self.at(par, chan, frozen.data), frozen.data
            inputs = sensor_inputs(model, data, wiring(self.model.signal_names)[:, [0, 2]])
            residual, path = np.empty_like(data.measured), np.empty((1, model.signals))
            self.model.loops.predict(
                model, data, frozen.start, frozen.gains, residual, path, inputs
            )
            # replaced by a single assignment, since other threads use it too
            kept = frozen.sensor_run = point, inputs, self._counted(frozen, residual)
        return kept[1], kept[2]

    def _start(self, par: Array, measured: Array) -> Array:
        """Return the equilibrium state at the first measured pressures and position."""
        first = {c: float(np.nanmean(measured[:10, i])) for i, c in enumerate(self.channels)
                 if np.isfinite(measured[:10, i]).any()}  # fmt: skip
        both = "pressure_a" in first and "pressure_b" in first
        pressures = (first["pressure_a"], first["pressure_b"]) if both else None
        start = self.model.start(par, self.steps.largest, pressures)
        if "position" in first:
            start[list(self.model.kernel.state.names or ()).index("position")] = first["position"]
        return start

    @property
    def balances(self) -> tuple[Balance, ...]:
        """Balances whose terms change the channels."""
        balances = {b for b, _ in TERMS if b.probes or b.channel in self.channels}
        return tuple(balances | ({SUPPLY} if "supply_pressure" in self.channels else set()))

    def noise_estimate(self, frozen: Frozen) -> None:
        """Return None: each experiment has a noise of its own."""

    def share(self, frozen: Frozen, noise: Noise) -> None:
        """Do nothing: there is no common noise."""

    def regressors(self, frozen: Frozen, path: Array) -> Regressors:
        """Return the regressors of free terms."""
        experiment = frozen.experiment
        return regressors(path, self.model.signal_names, experiment.period, experiment.readings)

    def entry(self, frozen: Frozen, balance: Balance) -> Entries:
        """Return the derivatives of the next z and reading by a term in a balance."""
        if balance is SUPPLY:
            return Entries(*(np.ascontiguousarray(j[:, :, -1]) for j in frozen.jacobians))
        weights = np.zeros(len(PROBES), np.float32)
        for probe, weight in balance.probes:
            weights[_INDEX[probe]] = weight
        drives, feeds = self.probed(frozen)
        return Entries(np.tensordot(drives, weights, 1), np.tensordot(feeds, weights, 1))

    def through(self, frozen: Frozen, balance: Balance, terms: Array) -> Single:
        """Return the change of the weighted innovations by terms along the trajectory."""
        count, m = frozen.data.measured.shape
        outputs = np.zeros((0, m, terms.shape[1]))
        if balance.channel:
            outputs = np.zeros((count, m, terms.shape[1]))
            outputs[:, frozen.channels.index(balance.channel)] = terms
        entry = self.entry(frozen, balance)
        columns = self._propagated(frozen, entry, terms[: 0 if balance.channel else count], outputs)
        columns *= frozen.weights.astype(np.float32)
        return columns.reshape(terms.shape[1], -1)

    def log_determinant(self, frozen: Frozen) -> float:
        """Return the logarithm of the determinant of the innovations' covariance.

        Infinite if the filter diverged.
        """
        counted = ~frozen.data.settling
        whitening = frozen.gains.whitening[counted].astype(np.float64)
        if not np.isfinite(whitening).all():
            return math.inf
        roots = np.linalg.slogdet(whitening)[1]
        present = np.isfinite(frozen.data.measured[counted]).sum(axis=0)
        return -2.0 * float(roots.sum() + present @ np.log(frozen.weights))

    def _propagated(self, frozen: Frozen, entry: Entries, inputs: Array, outputs: Array) -> Single:
        """Return the whitened innovations' derivatives by terms, (terms, samples, channels)."""
        columns = np.empty((outputs.shape[2], *frozen.data.measured.shape), np.float32)
        self.model.loops.propagate(
            frozen.gains, frozen.jacobians, entry, np.ascontiguousarray(inputs), outputs, columns
        )
        return self._counted(frozen, columns)

    def _counted(self, frozen: Frozen, columns: Columns) -> Columns:
        """Return columns, shape (..., samples, channels), with excluded samples set to zero."""
        columns[..., frozen.data.settling, :] = 0.0
        missing = ~np.isfinite(frozen.data.measured)
        if missing.any():
            columns[..., missing] = 0.0
        return columns

    def weigh(self, frozen: Frozen, par: Array, chan: Array) -> None:
        """Set the weights for innovations of unit variance in quiet stretches.

        Missing effects act during a part of the time; the rest gives the noise level.
        """
        frozen.weights = np.ones(len(frozen.channels))
        frozen.weights = self._quiet(frozen, self.innovations(frozen, par, chan)[0])

    def _quiet(self, frozen: Frozen, residual: Array) -> Array:
        """Return the inverse rms of each channel's residual in quiet stretches.

        Args:
            frozen: of one experiment.
            residual: shape (samples, channels).

        """
        counted = ~frozen.data.settling
        raw, present = residual[counted], np.isfinite(frozen.data.measured)[counted]
        length = round(INNOVATION_CORRELATION_TIME / frozen.data.period)
        spread = np.array([quiet_rms(raw[present[:, j], j], length) for j in range(raw.shape[1])])
        return np.asarray(1.0 / (np.sqrt(frozen.experiment.copies) * spread))


def _divided(current: Array, period: float) -> Array:
    """Return a current with each period [s] divided into parts of at most `LONGEST_PART`."""
    times = max(1, math.ceil(period / current.shape[1] / LONGEST_PART - 1e-9))
    return np.ascontiguousarray(np.repeat(current, times, axis=1))


def _settling(course: BetweenRows, burn_in: int) -> Mask:
    """Return a mask of excluded samples: the first ones, and those after a jump."""
    recent = np.convolve(course.jumps, np.ones(burn_in + 1))[: len(course.jumps)] > 0.5
    return np.asarray((np.arange(len(recent)) < burn_in) | recent)
