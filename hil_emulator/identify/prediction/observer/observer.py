"""Experiments seen through one model: gains frozen once, innovations for any parameters."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar
from weakref import WeakValueDictionary

import numpy as np

from hil_emulator.identify.measured.experiment import Array, BetweenRows, Experiment, Mask, Single
from hil_emulator.identify.prediction.filter.sensor_replay import HIDDEN, to_be_seen
from hil_emulator.identify.prediction.free_terms.balances import SUPPLY, TERMS, Balance
from hil_emulator.identify.prediction.free_terms.regressors import Regressors, regressors
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Entries,
    Gains,
    ParametrisedModel,
    Seen,
    Start,
)
from hil_emulator.identify.prediction.observer.form_deviations import deviations
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
from hil_emulator.identify.prediction.residuals.huber import tamed
from hil_emulator.identify.prediction.residuals.integrated_out import integrated_out
from hil_emulator.identify.prediction.residuals.noise import noise_levels, quiet_rms
from hil_emulator.model.sensors import wiring

INNOVATION_CORRELATION_TIME = 0.1
"""Least time over which innovations are taken to be correlated [s] (assumed)."""

REWEIGHED = 2
"""Times that weights are computed anew from what other forms of the base laws leave."""

RECENT = 4
"""Points at which the innovations are kept."""

BURN_IN = 0.05
"""Time that counts for nothing [s], at the start and after a jump of the current: states settle."""

LONGEST_PART = 1e-3
"""Longest part of a sample period within which slopes change evenly [s]: a fast spool opens an edge
in as much."""

Columns = TypeVar("Columns", Array, Single)

_INDEX = {probe.name: i for i, probe in enumerate(PROBES)}


class Observer:
    """Freezes gains and computes innovations.

    Args:
        model: the model.
        channels: the channels that take part.
        step: largest integration step [s]; a machine too fast for it gets a careful one.

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
        """Return what another process gets: what lives here does not live there."""
        return {**self.__dict__, "_living": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take it."""
        self.__dict__.update(state, _living=WeakValueDictionary())

    @property
    def correlation_time(self) -> float:
        """Least time over which innovations may be correlated [s]."""
        return INNOVATION_CORRELATION_TIME

    def cost(self, par: Array) -> float:
        """Return how much longer a prediction takes than one with careful steps."""
        return CAREFUL_STEP / self.steps.width(par)

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> Frozen:
        """Run the extended Kalman filter at given parameters and keep its gains.

        Where somebody still has what it made of the same experiment there, it is not run again.
        """
        point = id(experiment), par.tobytes() + chan.tobytes()
        known = self._living.get(point)
        if known is not None and known.experiment is experiment:
            return replace(known, weights=np.ones(len(self.channels)))
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
        """Return what each probe adds to the next z and reading; it has no width but its own."""
        if frozen.probed is None:
            # code that knows only what acts does not know the probes
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
        """Return the model at given parameters, with integration steps that are stable there.

        It serves for one run along the data, and tells what sensors see, or every signal.
        """
        period = data.period / data.current.shape[1]
        steps = max(1, int(np.ceil(period / self.steps.width(par) - 1e-9)))
        ticks = self.model.loops.ticks
        tick = ticks.whole if every_signal else ticks.at(par, steps * data.current.size)
        return self.model.at(par, chan, period / steps, steps, tick)

    def innovations(
        self, frozen: Frozen, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return weighted whitened innovations, and predicted signals where wanted."""
        data, recent, point = frozen.data, frozen.recent, par.tobytes() + chan.tobytes()
        path = np.empty((len(data.measured) if track else 1, len(self.model.signal_names)))
        if point in recent and not track:
            return recent[point] * frozen.weights, path
        residual = np.empty_like(data.measured)
        model = self.at(par, chan, data, every_signal=track)
        self.model.loops.predict(model, data, frozen.start, frozen.gains, residual, path, HIDDEN)
        residual[data.settling] = 0.0
        # as a whole: other threads predict as well
        frozen.recent = dict([*recent.items(), (point, residual)][-RECENT:])
        return residual * frozen.weights, path

    def with_other_sensors(
        self, frozen: Frozen, par: Array, chan: Array, others: Sequence[Array]
    ) -> Array:
        """Return the weighted innovations of a plant with other sensors, linearised along its run.

        Each set of sensors reads the run itself; how their readings move it is linear.
        """
        seen, base = self._seen(frozen, par, chan)
        data = frozen.data
        changes = np.empty((*data.measured.shape, len(others)))
        change = np.empty_like(data.measured)
        for i, other in enumerate(others):
            self.model.loops.reread(self.at(par, other, data), data, seen, change)
            changes[:, :, i] = change
        none = Entries(np.zeros((0, 0), np.float32), np.zeros((0, 0), np.float32))
        columns = self._propagated(frozen, none, np.zeros((0, len(others))), changes)
        return np.asarray((base + columns) * frozen.weights)

    def _seen(self, frozen: Frozen, par: Array, chan: Array) -> tuple[Seen, Array]:
        """Return what the sensors met at a point, and the whitened innovations there."""
        kept, point = frozen.seen, par.tobytes() + chan.tobytes()
        if kept is None or kept[0] != point:
            model, data = self.at(par, chan, frozen.data), frozen.data
            seen = to_be_seen(model, data, wiring(self.model.signal_names)[:, [0, 2]])
            residual, path = np.empty_like(data.measured), np.empty((1, model.signals))
            self.model.loops.predict(model, data, frozen.start, frozen.gains, residual, path, seen)
            # as a whole: other threads predict as well
            kept = frozen.seen = point, seen, self._counted(frozen, residual)
        return kept[1], kept[2]

    def _start(self, par: Array, measured: Array) -> Array:
        """Return the state at rest with what was measured at first put in."""
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
        """The balances that the channels can show."""
        found = {b for b, _ in TERMS if b.probes or b.channel in self.channels}
        return tuple(found | ({SUPPLY} if "supply_pressure" in self.channels else set()))

    def noise_estimate(self, frozen: Frozen) -> None:
        """Return that every experiment has a noise of its own."""

    def share(self, frozen: Frozen, noise: Noise) -> None:
        """Do nothing: there is none."""

    def regressors(self, frozen: Frozen, path: Array) -> Regressors:
        """Return what a term may depend on."""
        experiment = frozen.experiment
        return regressors(path, self.model.signal_names, experiment.period, experiment.readings)

    def entry(self, frozen: Frozen, balance: Balance) -> Entries:
        """Return what a term in a balance adds to the next z and the next reading."""
        if balance is SUPPLY:
            return Entries(*(np.ascontiguousarray(j[:, :, -1]) for j in frozen.jacobians))
        weights = np.zeros(len(PROBES), np.float32)
        for probe, weight in balance.probes:
            weights[_INDEX[probe]] = weight
        drives, feeds = self.probed(frozen)
        return Entries(np.tensordot(drives, weights, 1), np.tensordot(feeds, weights, 1))

    def through(self, frozen: Frozen, balance: Balance, terms: Array) -> Single:
        """Return the change of the weighted innovations that terms along the track make."""
        count, m = frozen.data.measured.shape
        outputs = np.zeros((0, m, terms.shape[1]))
        if balance.channel:
            outputs = np.zeros((count, m, terms.shape[1]))
            outputs[:, frozen.channels.index(balance.channel)] = terms
        entry = self.entry(frozen, balance)
        columns = self._propagated(frozen, entry, terms[: 0 if balance.channel else count], outputs)
        columns *= frozen.weights.astype(np.float32)
        return self.integrated_out(frozen, columns.reshape(terms.shape[1], -1))

    def integrated_out(self, frozen: Frozen, rows: Columns) -> Columns:
        """Return residuals or derivatives with other forms of the base laws integrated out."""
        if frozen.forms is None:
            return rows
        return frozen.forms.of(rows).astype(rows.dtype, copy=False)

    def relax(self, frozen: Frozen, par: Array, chan: Array) -> None:
        """Let base laws be of another published form along the run at these parameters."""
        frozen.forms = None
        laws, columns = deviations(self, frozen, par, chan)
        frozen.forms = integrated_out(columns, laws)
        for _ in range(REWEIGHED):
            left = frozen.forms.of(tamed(self.innovations(frozen, par, chan)[0]))
            finer = self._quiet(frozen, left.reshape(frozen.data.measured.shape))
            frozen.weights = frozen.weights * finer
            columns = columns * np.tile(finer, len(frozen.data.measured))
            frozen.forms = integrated_out(columns, laws)

    def log_determinant(self, frozen: Frozen) -> float:
        """Return the logarithm of the determinant of the innovations' covariance."""
        counted = ~frozen.data.settling
        roots = np.linalg.slogdet(frozen.gains.whitening[counted].astype(np.float64))[1]
        present = np.isfinite(frozen.data.measured[counted]).sum(axis=0)
        weighed = float(roots.sum() + present @ np.log(frozen.weights))
        forms = 0.0 if frozen.forms is None else frozen.forms.log_determinant
        return forms - 2.0 * weighed

    def _propagated(self, frozen: Frozen, entry: Entries, inputs: Array, outputs: Array) -> Single:
        """Return what terms make of the whitened innovations, shape (terms, samples, channels)."""
        columns = np.empty((outputs.shape[2], *frozen.data.measured.shape), np.float32)
        self.model.loops.propagate(
            frozen.gains, frozen.jacobians, entry, np.ascontiguousarray(inputs), outputs, columns
        )
        return self._counted(frozen, columns)

    def _counted(self, frozen: Frozen, columns: Columns) -> Columns:
        """Return columns, shape (..., samples, channels), without what counts for nothing."""
        columns[..., frozen.data.settling, :] = 0.0
        missing = ~np.isfinite(frozen.data.measured)
        if missing.any():
            columns[..., missing] = 0.0
        return columns

    def weigh(self, frozen: Frozen, par: Array, chan: Array) -> None:
        """Give each channel's innovations a standard deviation of one where nothing is missing.

        A missing effect acts in a part of the time; the quiet part tells how large noise is.
        """
        frozen.weights = np.ones(len(frozen.channels))
        frozen.weights = self._quiet(frozen, self.innovations(frozen, par, chan)[0])

    def _quiet(self, frozen: Frozen, residual: Array) -> Array:
        """Return one over how large each channel's residual is where nothing is missing.

        Args:
            frozen: an experiment.
            residual: of shape (samples, channels).

        """
        counted = ~frozen.data.settling
        raw, present = residual[counted], np.isfinite(frozen.data.measured)[counted]
        length = round(INNOVATION_CORRELATION_TIME / frozen.data.period)
        spread = np.array([quiet_rms(raw[present[:, j], j], length) for j in range(raw.shape[1])])
        return np.asarray(1.0 / (np.sqrt(frozen.experiment.copies) * spread))


def _divided(current: Array, period: float) -> Array:
    """Return a current in parts of each period [s] that are short enough for a linearisation."""
    times = max(1, math.ceil(period / current.shape[1] / LONGEST_PART - 1e-9))
    return np.ascontiguousarray(np.repeat(current, times, axis=1))


def _settling(course: BetweenRows, burn_in: int) -> Mask:
    """Return which samples count for nothing: the first ones, and those after a jump."""
    recent = np.convolve(course.jumps, np.ones(burn_in + 1))[: len(course.jumps)] > 0.5
    return np.asarray((np.arange(len(recent)) < burn_in) | recent)
