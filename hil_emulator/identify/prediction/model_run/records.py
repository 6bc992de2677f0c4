"""What the compiled loops take and give, by name; all of it SI.

Numba passes a named tuple as cheaply as its fields. It has to be a class of a module: machine code
that is kept for the next start finds it again by that name.
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
        tick: its integration, compiled for what acts there, see `ticks`.
        rate: the derivative of its state.
        sense: its sensor chain.
        par: the plant's parameters.
        chan: the transducers' parameters.
        drift: index of the null's drift in `par`.
        supply: index of the supply pressure in `par`.
        bend: index of the bend of the seals in the state vector.
        velocity: index of the velocity there.
        chambers: indices of the chambers' states there.
        sources: index of each channel's signal.
        remembered: how many values the set point, the transducers, and their histories remember.
        traced: which of those of the transducers are quantities that an acting element follows,
            and the indices of their signals, shape (traced, 2).
        recorded: which of those of the histories are samples on which an acting law looks back,
            and the indices of their signals, shape (recorded, 2).
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
        unknown: variance by which its mean over the period may be another one, shape (samples,)
            [A^2].
        measured: readings, shape (samples, chosen), NaN where missing.
        chosen: the channels that were measured.
        period: sample period [s].
        settling: samples that count for nothing, as the states settle.

    """

    current: Array
    unknown: Array
    measured: Array
    chosen: Index
    period: float
    settling: Mask


class Start(NamedTuple):
    """Where a run begins, and which states a filter follows.

    The augmented state z is the active states, then two Ornstein-Uhlenbeck disturbances: null drift
    of the valve [A] and deviation of the supply pressure [Pa].

    Attributes:
        state: vector of all states.
        z: augmented state.
        active: indices in `state` of the states in z.
        decay: what remains of the two disturbances after each of these parts.

    """

    state: Array
    z: Array
    active: Index
    decay: Array


class Tuning(NamedTuple):
    """How uncertain the model is: what a filter takes for granted about one experiment.

    Attributes:
        covariance: of z at the start.
        diffusion: variance that each element of z gains in a sample.
        widths: steps of the differences by each element, shape (z,).
        secant: smallest and largest step of that by velocity which counts while the rod creeps.
        settling: samples for which the spool, the first two of z, is as uncertain as at first.

    """

    covariance: Array
    diffusion: Array
    widths: Array
    secant: Array
    settling: int


class Gains(NamedTuple):
    """What turns errors into corrections and into innovations, in single precision.

    Attributes:
        kalman: Kalman gains, shape (samples, z, chosen).
        whitening: L with S^-1 = L L^T, shape (samples, chosen, chosen).

    """

    kalman: Single
    whitening: Single


class Jacobians(NamedTuple):
    """What a change of the corrected z does within a sample, in single precision.

    Difference quotients are no more exact than that, and those of a long recording are large.

    Attributes:
        maps: derivative of the next z, shape (samples, z, z).
        senses: derivative of the next reading, shape (samples, chosen, z).

    """

    maps: Single
    senses: Single


class Entries(NamedTuple):
    """What terms in the balances do within a sample, in single precision as `Jacobians` are.

    Of a single term the last axis is missing.

    Attributes:
        drives: derivative of the next z, shape (samples, z, terms).
        feeds: derivative of the next reading, shape (samples, chosen, terms).

    """

    drives: Single
    feeds: Single


class Seen(NamedTuple):
    """What the sensors met along one run.

    Attributes:
        watched: indices of the signals that any sensor looks at.
        signals: these signals at each sample, shape (samples, watched).
        corrected: the same after its correction.
        path: what their elements met since the last sample, shape (samples, instants, channels).
        reading: what they showed, shape (samples, chosen).

    """

    watched: Index
    signals: Array
    corrected: Array
    path: Array
    reading: Array


class Restarts(NamedTuple):
    """When a free run starts anew from the filtered state.

    Attributes:
        first: sample of the first restart.
        window: samples between restarts.

    """

    first: int
    window: int


class Errors(NamedTuple):
    """How far the readings are from the model, measured less predicted.

    Attributes:
        one: one step ahead, shape (samples, chosen).
        free: in the free run, NaN before it begins.
        track: the predictor's signals, shape (samples, signals).

    """

    one: Array
    free: Array
    track: Array


class Moments(NamedTuple):
    """Measured states of a bench of forces.

    Attributes:
        states: shape (samples, states).
        acceleration: of the rod [m/s²], shape (samples,).
        present: which are states of a rod that slides; the others are passed over.

    """

    states: Array
    acceleration: Array
    present: Mask


class Places(NamedTuple):
    """Where the force balance finds its terms: indices among the signals, of the cell among them.

    Attributes:
        hydraulic: hydraulic force.
        friction: friction force.
        stop: force of the cylinder's ends.
        load: force on the load.
        resisting: force of the surroundings against the load.
        rod_mass: mass ahead of the load cell.
        mass: index of the load's mass in `par`.
        cell: the load cell among the channels.
        driven: whether it measures the force that drives rod and load.

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
    """The states that are solved for.

    Attributes:
        places: their indices in the state.
        scales: a small deviation of each.
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
        given: states that are known, shape (rows, places).
        places: indices in the state of those.
        terms: terms that are put into balances, shape (rows, probes).
        period: between rows [s].

    """

    current: Array
    supply: Array
    given: Array
    places: Index
    terms: Array
    period: float
