"""One experiment with everything that one fit has computed of it."""

from dataclasses import dataclass, field

from hil_emulator.identify.measured.experiment import Array, Experiment
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Entries,
    Gains,
    Jacobians,
    SensorInputs,
    Start,
    Tuning,
)
from hil_emulator.identify.prediction.residuals.integrated_out import IntegratedOut


@dataclass
class Frozen:
    """One experiment with the gains of one fit.

    Attributes:
        experiment: the data.
        channels: measured channels, in the order of the columns.
        data: the same for the loops.
        start: where the filter begins.
        gains: those of the extended Kalman filter.
        jacobians: along its trajectory.
        predicted: z as it was predicted for each sample there, shape (samples, z).
        noise: standard deviation of each channel.
        tuning: what the filter took for granted.
        par, chan: the parameters at which it was frozen.
        weights: one over the standard deviation of each channel's whitened innovations.
        probed: what the probes do, see `Observer.probed`; None as long as nobody has asked.
        recent: the points at which it was last predicted, and the whitened innovations there: a fit
            often begins where another one has been.
        forms: what base laws of another form may do, integrated out of every residual.
        seen: a point, what the sensors met there, and the whitened innovations: many sensors are
            asked for at one.

    """

    experiment: Experiment
    channels: tuple[str, ...]
    data: Data
    start: Start
    gains: Gains
    jacobians: Jacobians
    predicted: Array
    noise: Array
    tuning: Tuning
    par: Array
    chan: Array
    weights: Array
    probed: Entries | None = None
    forms: IntegratedOut | None = None
    # not an argument: with other data or gains, what was predicted before would not hold
    recent: dict[bytes, Array] = field(default_factory=dict, init=False)
    sensor_run: tuple[bytes, SensorInputs, Array] | None = field(default=None, init=False)
