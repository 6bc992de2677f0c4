"""One run of the model along a recording: how every loop begins, proceeds and reads its sensors."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.records import ParametrisedModel, Start, Tick
from hil_emulator.model.constants import SLIDING_BEND
from hil_emulator.model.quantities import INPUTS

INPUT_COUNT = len(INPUTS)
"""Inputs of the model; the first is the valve current."""

Rate = Callable[[Array, Array, Array, Array, Array], None]
"""The kernel's derivative of the state, see `Kernel.rate`."""

Sense = Callable[[Array, Array, Array, Array, Array, Array, float, Array, Index], None]
"""The kernel's sensor chain, see `Kernel.sense`."""


class Run(NamedTuple):
    """A run of the model: what moves in it, and what it needs for its next step.

    Attributes:
        tick: its integration.
        z: augmented state, see `records.Start`.
        memory: the state vector, on which the integrator works.
        past: what the set point remembers.
        signals: the model's signals at this state.
        earlier: memory for what they were before a correction.
        path: what the sensors' elements met since the last sample, see `integrator.integrate`.
        par: the plant's parameters, in which the disturbances act.
        inputs: of the model.
        active: indices in the state vector of the states in z.
        drift: index of the null's drift in `par`.
        supply: index of the supply pressure in `par`.
        bend: index in z of the bend of the seals, -1 where dry friction does not act.
        position: index in z of the position of the rod.
        traced: what the sensors remember of quantities that they follow, see
            `records.ParametrisedModel`.
        recorded: indices of positions among the samples that they remember.
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
    path: Array
    par: Array
    inputs: Array
    active: Index
    drift: int
    supply: int
    bend: int
    position: int
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


def begin(model: ParametrisedModel, start: Start, currents: Array) -> Run:
    """Return a run at its start; the first of a period's currents acts until the first sample."""
    past = np.full(model.remembered[0], np.nan)
    bend = position = -1
    for i in range(len(start.active)):
        if start.active[i] == model.bend:
            bend = i
        if start.active[i] == model.position:
            position = i
    run = Run(
        model.tick, start.z.copy(), start.state.copy(), past, np.zeros(model.signals),
        np.zeros(model.signals),
        np.zeros((len(currents) * model.steps, len(model.sources))), model.par.copy(),
        np.zeros(INPUT_COUNT), start.active, model.drift, model.supply, bend,
        position, model.traced, model.recorded, model.par[model.supply], start.decay[0],
        start.decay[1], model.step,
    )  # fmt: skip
    advance(run, run.path, currents[0], 0)
    # what it measures has been at rest
    for i in range(len(model.sources)):
        run.path[:, i] = run.signals[model.sources[i]]
    return run


def beside(run: Run) -> Run:
    """Return a second run at the same state, with the same parameters."""
    return Run(
        run.tick, run.z.copy(), run.memory.copy(), run.past.copy(), run.signals.copy(),
        run.earlier.copy(),
        run.path.copy(), run.par, run.inputs, run.active, run.drift, run.supply, run.bend,
        run.position, run.traced, run.recorded, run.nominal, run.null_decay, run.supply_decay,
        run.step,
    )  # fmt: skip


def follow(run: Run, other: Run) -> None:
    """Put a run where another one is; its signals stay until it advances."""
    z, memory, past = run.z, run.memory, run.past
    for i in range(len(z)):
        z[i] = other.z[i]
    for i in range(len(memory)):
        memory[i] = other.memory[i]
    for i in range(len(past)):
        past[i] = other.past[i]


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
    for i in range(len(currents)):
        advance(run, run.path[i * steps : (i + 1) * steps], currents[i], steps)


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

    Within the time that an element filters, and a rod in all that a sensor looks back on, hardly
    anything moves otherwise than was thought: a rod which is farther out has been so before, and a
    late reading would tell it again in every sample. A jump of a quantity would be a motion to its
    element. Pressures that lie some samples back have been others.

    Args:
        run: whose z is corrected.
        instruments: its sensors.
        gain: Kalman gain, shape (z, chosen).
        error: measured less predicted, zero where nothing was measured, shape (chosen,).

    """
    z = run.z
    before = z[run.position]
    for i in range(len(z)):
        corrected = z[i]
        for j in range(len(error)):
            corrected += gain[i, j] * error[j]
        z[i] = corrected
    for i in run.recorded:
        instruments.history[i] += z[run.position] - before
    if len(run.traced) > 0:
        for i in range(len(run.signals)):
            run.earlier[i] = run.signals[i]
        advance(run, run.path, run.inputs[0], 0)
        trace(instruments, run.traced, run.earlier)


def trace(instruments: Instruments, traced: Index, before: Array) -> None:
    """Move what sensors remember of their signals as far as these have moved from those before."""
    for i in range(len(traced)):
        at = traced[i, 1]
        instruments.trace[traced[i, 0]] += instruments.signals[at] - before[at]
