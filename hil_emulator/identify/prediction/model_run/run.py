"""One run of the model along a recording: how every loop begins, proceeds and reads its sensors."""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    ParametrisedModel,
    Rate,
    Sense,
    Start,
    Tick,
)
from hil_emulator.identify.prediction.model_run.small_matrices import copy
from hil_emulator.model.constants import SLIDING_BEND
from hil_emulator.model.quantities import INPUTS

INPUT_COUNT = len(INPUTS)
"""Inputs of the model; the first is the valve current."""


class Run(NamedTuple):
    """A run of the model: what moves in it, and what it needs for its next step.

    Attributes:
        tick: its integration.
        z: augmented state, see `records.Start`.
        memory: the state vector, on which the integrator works.
        past: what the set point remembers.
        signals: the model's signals at this state.
        earlier: memory for what they were before a correction.
        sources: index of each channel's signal.
        steps: each channel's quantity when the period began, then after each of its integration
            steps, shape (1 + steps, channels).
        path: what the sensors' elements met since the last sample: the same, and what it was
            between, shape (2 * steps, channels).
        par: the plant's parameters, in which the disturbances act.
        inputs: of the model.
        active: indices in the state vector of the states in z.
        drift: index of the null's drift in `par`.
        supply: index of the supply pressure in `par`.
        bend: index in z of the bend of the seals, -1 where dry friction does not act.
        traced: what the sensors remember of quantities that they follow, see
            `records.ParametrisedModel`.
        recorded: which of the samples that they look back on are of quantities, likewise.
        nominal: supply pressure without its disturbance [Pa].
        null_decay: what remains of the null's drift after `advance`.
        supply_decay: what remains of the supply's deviation.
        step: integration step [s].

    """

    tick: Tick
    z: Array
    memory: Array
    past: Array
    signals: Array
    earlier: Array
    sources: Index
    steps: Array
    path: Array
    par: Array
    inputs: Array
    active: Index
    drift: int
    supply: int
    bend: int
    traced: Index
    recorded: Index
    nominal: float
    null_decay: float
    supply_decay: float
    step: float


class Instruments(NamedTuple):
    """The sensors of a run, without noise: what the kernel's `sense` takes, in its order.

    Attributes:
        signals: what they measure.
        path: what their elements met since the last sample, shape (steps, channels).
        chan: the transducers' parameters.
        trace: what they remember.
        history: the samples that they remember.
        normal: their noise.
        period: time since the last sample [s].
        reading: what they show.
        overrange: where they are at the end of their range, see `sensors.sample`.

    """

    signals: Array
    path: Array
    chan: Array
    trace: Array
    history: Array
    normal: Array
    period: float
    reading: Array
    overrange: Index


class Passage(NamedTuple):
    """A run along a recording.

    Attributes:
        run: the run.
        rate: the derivative of the model's state.
        sense: its sensor chain.
        instruments: its sensors.
        data: the recording.
        steps: integration steps in each part of a period, see `records.ParametrisedModel`.
        error: measured less predicted, zero where nothing was measured, shape (chosen,).
        corrected: memory for the run as it is after a correction.
        moved: memory for a run that goes on from elsewhere.

    """

    run: Run
    rate: Rate
    sense: Sense
    instruments: Instruments
    data: Data
    steps: int
    error: Array
    corrected: Run
    moved: Run


def enter(model: ParametrisedModel, data: Data, start: Start) -> Passage:
    """Return a run before the first sample of a recording."""
    run = begin(model, start, data.current[0])
    instruments = install(model, run.signals, run.path, data.period)
    error = np.zeros(len(data.chosen))
    return Passage(
        run, model.rate, model.sense, instruments, data, model.steps, error, beside(run),
        beside(run),
    )  # fmt: skip


def compare(passage: Passage, k: int) -> None:
    """Compare what the instruments show with what was measured in a sample."""
    data, error = passage.data, passage.error
    for i in range(len(error)):
        error[i] = data.measured[k, i] - passage.instruments.reading[data.chosen[i]]
        if not np.isfinite(data.measured[k, i]):
            error[i] = 0.0


def begin(model: ParametrisedModel, start: Start, currents: Array) -> Run:
    """Return a run at its start; the first of a period's currents acts until the first sample."""
    past = np.full(model.remembered[0], np.nan)
    bend = -1
    for i in range(len(start.active)):
        if start.active[i] == model.bend:
            bend = i
    run = Run(
        model.tick, start.z.copy(), start.state.copy(), past, np.zeros(model.signals),
        np.zeros(model.signals), model.sources,
        np.zeros((1 + len(currents) * model.steps, len(model.sources))),
        np.zeros((2 * len(currents) * model.steps, len(model.sources))), model.par.copy(),
        np.zeros(INPUT_COUNT), start.active, model.drift, model.supply, bend, model.traced,
        model.recorded, model.par[model.supply], start.decay[0], start.decay[1], model.step,
    )  # fmt: skip
    advance(run, run.steps, currents[0], 0)
    # what it measures has been at rest
    for i in range(len(model.sources)):
        run.path[:, i] = run.signals[model.sources[i]]
    return run


def beside(run: Run) -> Run:
    """Return a second run at the same state, with the same parameters."""
    return Run(
        run.tick, run.z.copy(), run.memory.copy(), run.past.copy(), run.signals.copy(),
        run.earlier.copy(), run.sources, run.steps.copy(), run.path.copy(), run.par, run.inputs,
        run.active, run.drift, run.supply, run.bend, run.traced, run.recorded,
        run.nominal, run.null_decay, run.supply_decay, run.step,
    )  # fmt: skip


def follow(run: Run, other: Run) -> None:
    """Put a run where another one is; its signals stay until it advances."""
    copy(other.z, run.z)
    copy(other.memory, run.memory)
    copy(other.past, run.past)


def advance(run: Run, path: Array, current: float, steps: int) -> None:
    """Map z over some integration steps; memory and signals then belong to the new state.

    The rows of `path` are what the sensors' elements meet after each step. No step at all puts z
    into the memory and computes the signals there.
    """
    z, memory, par, inputs, active = run.z, run.memory, run.par, run.inputs, run.active
    n = len(active)
    if run.bend >= 0:  # a correction by readings knows no bounds, seals do
        z[run.bend] = max(-SLIDING_BEND, min(SLIDING_BEND, z[run.bend]))
    for i in range(n):
        memory[active[i]] = z[i]
    if steps > 0:
        z[n] *= run.null_decay
        z[n + 1] *= run.supply_decay
    inputs[0] = current
    par[run.drift] = z[n]
    par[run.supply] = run.nominal + z[n + 1]
    run.tick(memory, run.past, par, inputs, run.signals, path, run.step, steps)
    for i in range(n):
        z[i] = memory[active[i]]


def elapse(run: Run, currents: Array, steps: int) -> None:
    """Let a sample period pass, in which the current takes some values one after the other."""
    begin_period(run)
    for i in range(len(currents)):
        elapse_part(run, currents, i, steps)
    end_period(run)


def begin_period(run: Run) -> None:
    """Note what each channel's quantity is when a period begins."""
    for i in range(len(run.sources)):
        run.steps[0, i] = run.signals[run.sources[i]]


def elapse_part(run: Run, currents: Array, i: int, steps: int) -> None:
    """Let the part of a period pass in which one current acts."""
    first = 1 + i * steps
    advance(run, run.steps[first : first + steps], currents[i], steps)


def end_period(run: Run) -> None:
    """Fill in what the sensors' elements met, where there are any."""
    if len(run.traced) > 0:
        refine(run)


def refine(run: Run) -> None:
    """Fill in what elements meet: in the middle of a step, the parabola through three ends of one.

    An element takes what it meets for straight between; in half a millisecond no pressure is.
    """
    ends, path = run.steps, run.path
    last = len(ends) - 1
    for j in range(1, len(ends)):
        for i in range(ends.shape[1]):
            begun, ended = ends[j - 1, i], ends[j, i]
            bend = 0.0
            if j < last:
                bend = begun - 2.0 * ended + ends[j + 1, i]
            elif j > 1:
                bend = ends[j - 2, i] - 2.0 * begun + ended
            path[2 * j - 2, i] = 0.5 * (begun + ended) - 0.125 * bend
            path[2 * j - 1, i] = ended


def install(model: ParametrisedModel, signals: Array, path: Array, period: float) -> Instruments:
    """Return sensors that remember nothing yet, and are read once in a sample period [s]."""
    count = len(model.sources)
    return Instruments(
        signals, path, model.chan, np.full(model.remembered[1], np.nan),
        np.full(model.remembered[2], np.nan), np.zeros(count), period, np.zeros(count),
        np.zeros(count, np.int64),
    )  # fmt: skip


def correct(run: Run, instruments: Instruments, gain: Array, error: Array) -> None:
    """Correct z by what the readings show, and what the sensors remember.

    Within the time that an element filters, or on which a sensor looks back, hardly anything moves
    otherwise than was thought: a rod which is farther out has been so before, and a late reading
    would tell it again in every sample. A jump of a quantity would be a motion to its element.

    Args:
        run: whose z is corrected.
        instruments: its sensors.
        gain: Kalman gain, shape (z, chosen).
        error: measured less predicted, zero where nothing was measured, shape (chosen,).

    """
    z = run.z
    for i in range(len(z)):
        corrected = z[i]
        for j in range(len(error)):
            corrected += gain[i, j] * error[j]
        z[i] = corrected
    if len(run.traced) + len(run.recorded) > 0:
        for i in range(len(run.signals)):
            run.earlier[i] = run.signals[i]
        advance(run, run.steps, run.inputs[0], 0)
        move(instruments.trace, run.traced, run.signals, run.earlier)
        move(instruments.history, run.recorded, run.signals, run.earlier)


def move(memory: Array, places: Index, signals: Array, before: Array) -> None:
    """Move what is remembered of signals as far as these have moved from those before."""
    for i in range(len(places)):
        memory[places[i, 0]] += signals[places[i, 1]] - before[places[i, 1]]
