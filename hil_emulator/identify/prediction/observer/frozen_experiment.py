"""One experiment with the gains and linearisations of one fit."""

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


@dataclass
class Frozen:
    """One experiment with the gains of one fit.

    Attributes:
        experiment: the data.
        channels: measured channels, in the order of the columns.
        data: the data for the compiled loops.
        start: initial state of the filter.
        gains: of the extended Kalman filter.
        jacobians: along its trajectory.
        predicted: predicted z of each sample, shape (samples, z).
        noise: standard deviation of each channel.
        tuning: of the filter.
        par, chan: parameters at which the gains were computed.
        weights: inverse standard deviation of each channel's whitened innovations.
        probed: derivatives by the probes, see `Observer.probed`; None until they are needed.
        recent: cached whitened innovations at the last points, at which fits often start.
        sensor_run: a point, the inputs of the sensors there, and the whitened innovations; used by
            the derivatives by many sensor errors.

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
    # not copied by `replace`: caches are not valid with other data or gains
    recent: dict[bytes, Array] = field(default_factory=dict, init=False)
    sensor_run: tuple[bytes, SensorInputs, Array] | None = field(default=None, init=False)
