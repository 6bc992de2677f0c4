"""Named tuples for arguments and results of the compiled loops, in SI units.

Numba passes a named tuple at no extra cost. The class must belong to a module, since cached machine
code finds it by its qualified name.
"""

from collections.abc import Callable
from typing import NamedTuple

from hil_emulator.identify.measured.experiment import Array, Index, Mask, Single

Tick = Callable[[Array, Array, Array, Array, Array, Array, float, int], bool]
"""The model's integration over one sample, see `Kernel.tick`."""

Rate = Callable[[Array, Array, Array, Array, Array], None]
"""The derivative of its state, see `Kernel.rate`."""

Sense = Callable[[Array, Array, Array, Array, Array, Array, float, Array, Index], None]
"""Its sensor chain, see `Kernel.sense`."""


class ParametrisedModel(NamedTuple):
    """The model at one set of parameters.

    Attributes:
        tick: integration, compiled for the acting effects, see `ticks`.
        rate: derivative of the state.
        sense: sensor chain.
        par: parameters of the plant.
        chan: parameters of the transducers.
        drift: index of the null drift in `par`.
        supply: index of the supply pressure in `par`.
        bend: index of the deflection of the seals in the state vector.
        velocity: index of the velocity in the state vector.
        chambers: indices of the chambers' states in the state vector.
        sources: index of each channel's signal.
        remembered: sizes of the memories of set point, transducers and sample histories.
        traced: indices in the transducers' memory of quantities that an acting element filters,
            and of their signals, shape (traced, 2).
        recorded: indices in the histories of samples that an acting law uses, and of their
            signals, shape (recorded, 2).
        signals: number of signals.
        step: integration step [s].
        steps: integration steps in each part of a sample period that has a current of its own.

    """

    tick: Tick
    rate: Rate
    sense: Sense
    par: Array
    chan: Array
    drift: int
    supply: int
    bend: int
    velocity: int
    chambers: Index
    sources: Index
    remembered: Index
    traced: Index
    recorded: Index
    signals: int
    step: float
    steps: int


class Data(NamedTuple):
    """One experiment.

    Attributes:
        current: valve current after each sample, in equal parts of the period, shape
            (samples, parts) [A].
        unknown: variance of its mean over the period, shape (samples,) [A^2].
        measured: readings, shape (samples, chosen), NaN where missing.
        chosen: measured channels.
        period: sample period [s].
        settling: mask of samples that are excluded while the states settle.

    """

    current: Array
    unknown: Array
    measured: Array
    chosen: Index
    period: float
    settling: Mask


class Start(NamedTuple):
    """Initial state of a run, and the states of the filter.

    The augmented state z is the active states, then two Ornstein-Uhlenbeck disturbances: null drift
    of the valve [A] and deviation of the supply pressure [Pa].

    Attributes:
        state: vector of all states.
        z: augmented state.
        active: indices in `state` of the states in z.
        decay: decay factors of the two disturbances over a part of a period.

    """

    state: Array
    z: Array
    active: Index
    decay: Array


class Tuning(NamedTuple):
    """Uncertainty of the model in one experiment, for the filter.

    Attributes:
        covariance: of z at the start.
        diffusion: process noise variance of each element of z per sample.
        widths: steps of the finite differences by each element, shape (z,).
        secant: smallest and largest step by the velocity at creep.
        settling: samples in which the spool, the first two elements of z, is as uncertain as at
            the start.

    """

    covariance: Array
    diffusion: Array
    widths: Array
    secant: Array
    settling: int


class Gains(NamedTuple):
    """Gains of corrections and whitened innovations, in single precision.

    Attributes:
        kalman: Kalman gains, shape (samples, z, chosen).
        whitening: L with S^-1 = L L^T, shape (samples, chosen, chosen).

    """

    kalman: Single
    whitening: Single


class Jacobians(NamedTuple):
    """Derivatives by the corrected z over a sample, in single precision.

    Finite differences are not more precise, and the arrays of long recordings are large.

    Attributes:
        maps: derivative of the next z, shape (samples, z, z).
        senses: derivative of the next reading, shape (samples, chosen, z).

    """

    maps: Single
    senses: Single


class Entries(NamedTuple):
    """Derivatives by terms in the balances over a sample, in single precision.

    The last axis is missing for a single term.

    Attributes:
        drives: derivative of the next z, shape (samples, z, terms).
        feeds: derivative of the next reading, shape (samples, chosen, terms).

    """

    drives: Single
    feeds: Single


class SensorInputs(NamedTuple):
    """Inputs and readings of the sensors along one run.

    Attributes:
        watched: indices of the signals that the sensors use.
        signals: these signals at each sample, shape (samples, watched).
        corrected: these signals after the correction.
        path: inputs of the elements since the last sample, shape (samples, instants, channels).
        reading: readings, shape (samples, chosen).

    """

    watched: Index
    signals: Array
    corrected: Array
    path: Array
    reading: Array


class Restarts(NamedTuple):
    """Restarts of a free run from the filtered state.

    Attributes:
        first: sample of the first restart.
        window: samples between restarts.

    """

    first: int
    window: int


class Errors(NamedTuple):
    """Prediction errors: measured minus predicted.

    Attributes:
        one: one step ahead, shape (samples, chosen).
        free: in the free run, NaN before it begins.
        track: the predictor's signals, shape (samples, signals).

    """

    one: Array
    free: Array
    track: Array


class Moments(NamedTuple):
    """Measured states of a force bench.

    Attributes:
        states: shape (samples, states).
        acceleration: of the rod [m/s²], shape (samples,).
        present: mask of the states that are used.

    """

    states: Array
    acceleration: Array
    present: Mask


class Places(NamedTuple):
    """Indices of the terms of the force balance among the signals.

    Attributes:
        hydraulic: hydraulic force.
        friction: friction force.
        stop: force of the cylinder's ends.
        load: force on the load.
        resisting: external force on the load.
        rod_mass: mass ahead of the load cell.
        mass: index of the load's mass in `par`.
        cell: index of the load cell among the channels.
        driven: whether the cell measures the force that drives rod and load.

    """

    hydraulic: int
    friction: int
    stop: int
    load: int
    resisting: int
    rod_mass: int
    mass: int
    cell: int
    driven: bool


class Unknowns(NamedTuple):
    """Unknown states of an equilibrium.

    Attributes:
        places: their indices in the state.
        scales: typical small deviation of each.
        least: smallest value of each.

    """

    places: Index
    scales: Array
    least: Array


class Sweep(NamedTuple):
    """A slow sweep, row by row.

    Attributes:
        current: valve current [A].
        supply: supply pressure [Pa].
        given: given states, shape (rows, places).
        places: their indices in the state.
        terms: terms in the balances, shape (rows, probes).
        period: between rows [s].

    """

    current: Array
    supply: Array
    given: Array
    places: Index
    terms: Array
    period: float
