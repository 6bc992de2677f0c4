"""Run of the model along a recording: start, integration, sensors and corrections of all loops."""

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
    """State of a run of the model, and memory for its next step.

    Attributes:
        tick: integration of the model.
        z: augmented state, see `records.Start`.
        memory: state vector of the integrator.
        past: memory of the set point.
        signals: signals of the model at this state.
        earlier: signals before a correction.
        sources: index of each channel's signal.
        steps: quantity of each channel at the start of the period and after each integration step,
            shape (1 + steps, channels).
        path: inputs of the sensors since the last sample, at the ends and in the middle of each
            step, shape (2 * steps, channels).
        par: parameters of the plant, including the disturbances.
        inputs: of the model.
        active: indices in the state vector of the states in z.
        drift: index of the null drift in `par`.
        supply: index of the supply pressure in `par`.
        bend: index in z of the deflection of the seals, -1 without dry friction.
        traced: sensor memories that are shifted by corrections, see `records.ParametrisedModel`.
        recorded: sample memories that are shifted by corrections, likewise.
        nominal: supply pressure without its disturbance [Pa].
        null_decay: decay factor of the null drift over `advance`.
        supply_decay: decay factor of the supply's deviation.
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
    """Noise-free sensors of a run: arguments of the kernel's `sense`, in its order.

    Attributes:
        signals: measured signals.
        path: their values since the last sample, shape (steps, channels).
        chan: parameters of the transducers.
        trace: memory of the sensing elements.
        history: stored samples.
        normal: noise.
        period: time since the last sample [s].
        reading: readings.
        overrange: flags of saturated readings, see `sensors.sample`.

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
        run: of the model.
        rate: derivative of the model's state.
        sense: sensor chain of the model.
        instruments: its sensors.
        data: the recording.
        steps: integration steps in each part of a period, see `records.ParametrisedModel`.
        error: measured minus predicted, zero where missing, shape (chosen,).
        corrected: memory for the run after a correction.
        moved: memory for a run from a changed state.

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
    """Return the run before the first sample of a recording."""
    run = begin(model, start, data.current[0])
    instruments = install(model, run.signals, run.path, data.period)
    error = np.zeros(len(data.chosen))
    return Passage(
        run, model.rate, model.sense, instruments, data, model.steps, error, second_run(run),
        second_run(run),
    )  # fmt: skip


def compare(passage: Passage, k: int) -> None:
    """Compute the differences of measured and predicted readings in a sample."""
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
    # the sensors start in steady state
    for i in range(len(model.sources)):
        run.path[:, i] = run.signals[model.sources[i]]
    return run


def second_run(run: Run) -> Run:
    """Return a copy of a run that shares its parameters."""
    return Run(
        run.tick, run.z.copy(), run.memory.copy(), run.past.copy(), run.signals.copy(),
        run.earlier.copy(), run.sources, run.steps.copy(), run.path.copy(), run.par, run.inputs,
        run.active, run.drift, run.supply, run.bend, run.traced, run.recorded,
        run.nominal, run.null_decay, run.supply_decay, run.step,
    )  # fmt: skip


def follow(run: Run, other: Run) -> None:
    """Copy the state of another run; signals are updated by the next `advance`."""
    copy(other.z, run.z)
    copy(other.memory, run.memory)
    copy(other.past, run.past)


def advance(run: Run, path: Array, current: float, steps: int) -> None:
    """Integrate z over some steps, and update memory and signals.

    The rows of `path` receive the inputs of the sensors after each step. With zero steps, z is
    copied to the memory and the signals are computed.
    """
    z, memory, par, inputs, active = run.z, run.memory, run.par, run.inputs, run.active
    n = len(active)
    if run.bend >= 0:  # a correction may exceed the bounds of the seals' deflection
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
    """Advance by one sample period with a sequence of currents."""
    begin_period(run)
    for i in range(len(currents)):
        elapse_part(run, currents, i, steps)
    end_period(run)


def begin_period(run: Run) -> None:
    """Store each channel's quantity at the start of a period."""
    for i in range(len(run.sources)):
        run.steps[0, i] = run.signals[run.sources[i]]


def elapse_part(run: Run, currents: Array, i: int, steps: int) -> None:
    """Advance by the part of a period with one value of the current."""
    first = 1 + i * steps
    advance(run, run.steps[first : first + steps], currents[i], steps)


def end_period(run: Run) -> None:
    """Compute the inputs of sensors with dynamic elements."""
    if len(run.traced) > 0:
        refine(run)


def refine(run: Run) -> None:
    """Interpolate the sensors' inputs in the middle of each step, by a parabola.

    Sensing elements interpolate linearly, which is too coarse over a step of 0.5 ms.
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
    """Return sensors with empty memory that are read once per sample period [s]."""
    count = len(model.sources)
    return Instruments(
        signals, path, model.chan, np.full(model.remembered[1], np.nan),
        np.full(model.remembered[2], np.nan), np.zeros(count), period, np.zeros(count),
        np.zeros(count, np.int64),
    )  # fmt: skip


def correct(run: Run, instruments: Instruments, gain: Array, error: Array) -> None:
    """Correct z by the readings, and shift the sensors' memory by the same change.

    Over the time constant or delay of a sensor the error of the state hardly changes. Without the
    shift, a delayed reading would repeat the same correction in every sample, and a lagging element
    would see the correction as a jump.

    Args:
        run: whose z is corrected.
        instruments: its sensors.
        gain: Kalman gain, shape (z, chosen).
        error: measured minus predicted, zero where missing, shape (chosen,).

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
    """Shift stored values of signals by the change of these signals."""
    for i in range(len(places)):
        memory[places[i, 0]] += signals[places[i, 1]] - before[places[i, 1]]
