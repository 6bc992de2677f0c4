"""Experiments seen through one model: gains frozen once, innovations for any parameters."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.balances import SUPPLY, TERMS, Balance
from hil_emulator.identify.prediction.frozen import Frozen
from hil_emulator.identify.prediction.noise import noise_levels, quiet_rms
from hil_emulator.identify.prediction.plant_model import PlantModel
from hil_emulator.identify.prediction.probes import PROBES
from hil_emulator.identify.prediction.regressors import Regressors, regressors
from hil_emulator.identify.prediction.tuning import tuning

LARGEST_STEP = 2.5e-4
"""Integration step of a prediction [s]; half of it moves no estimate by more than 1 %, and twice as
much takes longer, as the integrator divides steps that bend."""

SMALLEST_STEP = 1e-5
"""Integration step below which no effect is followed [s]."""

STABLE = 2.0
"""Step times largest eigenvalue: classical Runge-Kutta is stable up to 2.785."""

INNOVATION_CORRELATION_TIME = 0.1
"""Time over which innovations may be correlated [s] (assumed)."""

BURN_IN = 0.05
"""Time at the start of an experiment that counts for nothing [s]: the states settle."""

EARLIER_COMMAND_TIME = 0.02
"""Time for which set points from before the recording may act [s] (assumed)."""

_INDEX = {probe.name: i for i, probe in enumerate(PROBES)}


class Observer:
    """Freezes gains and computes innovations.

    Args:
        model: the model.
        channels: the channels that take part.
        step: largest integration step [s].

    """

    measure = "standard deviations of the noise"

    def __init__(
        self, model: PlantModel, channels: tuple[str, ...], step: float = LARGEST_STEP
    ) -> None:
        self.model = model
        self.channels = channels
        self.largest_step = step
        self.chosen = np.array([model.names.index(c) for c in channels])
        self._last = (b"", step)

    @property
    def correlation_time(self) -> float:
        """Time over which innovations may be correlated [s]."""
        return INNOVATION_CORRELATION_TIME

    def step(self, par: Array) -> float:
        """Return an integration step that is stable for these parameters [s]."""
        key, last = par.tobytes(), self._last
        if key != last[0]:
            fastest = max(self.model.fastest(par), 1.0)
            last = key, min(self.largest_step, max(SMALLEST_STEP, STABLE / fastest))
            # as a whole: other threads predict as well
            self._last = last
        return last[1]

    def cost(self, par: Array) -> float:
        """Return how much longer a prediction takes than one with the largest step."""
        return self.largest_step / self.step(par)

    def freeze(self, experiment: Experiment, par: Array, chan: Array) -> Frozen:
        """Run the extended Kalman filter at given parameters and keep its gains."""
        model, n_m = self.model, len(self.channels)
        measured = experiment.matrix(self.channels)
        noise = noise_levels(experiment, self.channels)
        names = list(model.kernel.state.names or ())
        active_names = model.active(par)
        active = np.array([names.index(n) for n in active_names])
        start = self._start(par, measured)
        tuned = tuning(model, par, active_names, start[active], experiment)
        z0 = np.concatenate([start[active], [0.0, 0.0]])
        count, n = len(measured), len(z0)
        shapes = ((n, n_m), (n_m, n_m), (n, n), (n_m, n))
        arrays = [np.zeros((count, *shape)) for shape in shapes]
        steps = self._steps(experiment, par)
        model.loops.linearise(
            start, z0, tuned.covariance, tuned.scales, active, par, model.drift, model.supply, chan,
            model.remembered, model.sources, self.chosen, np.ones(n_m), len(model.signal_names),
            experiment.current, measured, noise**2, tuned.diffusion, tuned.decay,
            round(EARLIER_COMMAND_TIME / experiment.period), round(BURN_IN / experiment.period),
            experiment.period, experiment.period / steps, steps, *arrays,
        )  # fmt: skip
        gains, whitening, maps, senses = arrays
        return Frozen(
            experiment, self.channels, self.chosen, measured, start, z0, active, tuned.decay,
            gains, whitening, maps, senses, np.ones(n_m), noise, tuned.diffusion, par, chan,
        )  # fmt: skip

    def probed(self, frozen: Frozen) -> tuple[Array, Array]:
        """Return what each probe adds to the next z and reading, see `probing.probe`."""
        if frozen.probed is None:
            model, e = self.model, frozen.experiment
            (count, m), n, steps = frozen.measured.shape, len(frozen.z0), self._steps(e, frozen.par)
            drives, feeds = (np.zeros((count, rows, len(PROBES))) for rows in (n, m))
            model.loops.probe(
                frozen.start, frozen.z0, frozen.active, frozen.par, model.drift, model.supply,
                model.probes, model.probe_sizes, frozen.chan, model.remembered, model.sources,
                frozen.chosen, len(model.signal_names), e.current, frozen.measured, frozen.gains,
                frozen.decay, e.period, e.period / steps, steps, drives, feeds,
            )  # fmt: skip
            frozen.probed = drives, feeds
        return frozen.probed

    def _steps(self, experiment: Experiment, par: Array) -> int:
        """Return the integration steps of a sample."""
        return max(1, int(np.ceil(experiment.period / self.step(par) - 1e-9)))

    def innovations(
        self, frozen: Frozen, par: Array, chan: Array, track: bool = False
    ) -> tuple[Array, Array]:
        """Return weighted whitened innovations, and predicted signals where wanted."""
        rows = len(frozen.measured) if track else 1
        path = np.empty((rows, len(self.model.signal_names)))
        residual = np.empty_like(frozen.measured)
        self._predict(frozen, par, chan, residual, path)
        residual[: round(BURN_IN / frozen.experiment.period)] = 0.0
        return residual * frozen.weights, path

    def _predict(
        self, frozen: Frozen, par: Array, chan: Array, residual: Array, path: Array
    ) -> None:
        model, experiment = self.model, frozen.experiment
        steps = self._steps(experiment, par)
        model.loops.predict(
            frozen.start, frozen.z0, frozen.active, par, model.drift, model.supply, chan,
            model.remembered, model.sources, frozen.chosen, experiment.current, frozen.measured,
            frozen.gains, frozen.whitening, frozen.decay, experiment.period,
            experiment.period / steps, steps, residual, path,
        )  # fmt: skip

    def _start(self, par: Array, measured: Array) -> Array:
        """Return the state at rest with what was measured at first put in."""
        first = {c: float(np.nanmean(measured[:10, i])) for i, c in enumerate(self.channels)
                 if np.isfinite(measured[:10, i]).any()}  # fmt: skip
        both = "pressure_a" in first and "pressure_b" in first
        pressures = (first["pressure_a"], first["pressure_b"]) if both else None
        start = self.model.start(par, self.largest_step, pressures)
        if "position" in first:
            start[list(self.model.kernel.state.names or ()).index("position")] = first["position"]
        return start

    @property
    def balances(self) -> tuple[Balance, ...]:
        """The balances that the channels can show."""
        found = {b for b, _ in TERMS if not b.channel or b.channel in self.channels}
        if "supply_pressure" not in self.channels:
            found.discard(SUPPLY)
        return tuple(found)

    def regressors(self, frozen: Frozen, path: Array) -> Regressors:
        """Return what a term may depend on."""
        return regressors(path, self.model.signal_names, frozen.experiment.period)

    def through(self, frozen: Frozen, balance: Balance, term: Array) -> Array:
        """Return the change of the weighted innovations that a term along the track makes."""
        count, m = frozen.measured.shape
        drives, feeds = self.probed(frozen)
        inputs = np.zeros((count, drives.shape[2]))
        outputs = np.zeros((count, m))
        for probe, weight in balance.probes:
            inputs[:, _INDEX[probe]] = weight * term
        if balance.channel:
            outputs[:, frozen.channels.index(balance.channel)] = term
        if balance is SUPPLY:
            drives = np.ascontiguousarray(frozen.maps[:, :, -1:])
            feeds = np.ascontiguousarray(frozen.senses[:, :, -1:])
            inputs = term[:, None].copy()
        column = np.empty((count, m))
        self.model.loops.propagate(
            frozen.gains, frozen.whitening, frozen.maps, frozen.senses, drives, feeds, inputs,
            outputs, column,
        )  # fmt: skip
        column[~np.isfinite(frozen.measured)] = 0.0
        column[: round(BURN_IN / frozen.experiment.period)] = 0.0
        return np.asarray((column * frozen.weights).ravel())

    def weigh(self, frozen: Frozen, par: Array, chan: Array) -> None:
        """Give each channel's innovations a standard deviation of one where nothing is missing.

        A missing effect acts in a part of the time; the quiet part tells how large noise is.
        """
        frozen.weights = np.ones(len(frozen.channels))
        raw = self.innovations(frozen, par, chan)[0][round(BURN_IN / frozen.experiment.period) :]
        present = np.isfinite(frozen.measured)[-len(raw) :]
        length = round(INNOVATION_CORRELATION_TIME / frozen.experiment.period)
        spread = np.array([quiet_rms(raw[present[:, j], j], length) for j in range(raw.shape[1])])
        scale = np.sqrt(frozen.experiment.copies)
        frozen.weights = 1.0 / (scale * spread)
