"""One experiment with everything that one fit has computed of it."""

from dataclasses import dataclass

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Experiment


@dataclass
class Frozen:
    """One experiment with the gains of one fit.

    Attributes:
        experiment: the data.
        channels: measured channels, in the order of the columns.
        measured: readings, shape (samples, channels).
        start: state at the start, of all states.
        z0: augmented state at the start.
        active: indices of the states in z.
        decay: what remains of the disturbances after a sample.
        gains, whitening, maps, senses: see `linearised.linearise`.
        weights: one over the standard deviation of each channel's whitened innovations.
        noise: standard deviation of each channel.
        diffusion: variance that the disturbances give each element of z in a sample.
        par, chan: the parameters at which it was frozen.
        probed: drives and feeds, see `probing.probe`; None as long as nobody has asked.

    """

    experiment: Experiment
    channels: tuple[str, ...]
    chosen: np.ndarray[tuple[int], np.dtype[np.int64]]
    measured: Array
    start: Array
    z0: Array
    active: np.ndarray[tuple[int], np.dtype[np.int64]]
    decay: Array
    gains: Array
    whitening: Array
    maps: Array
    senses: Array
    weights: Array
    noise: Array
    diffusion: Array
    par: Array
    chan: Array
    probed: tuple[Array, Array] | None = None
