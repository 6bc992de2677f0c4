"""A slow sweep, each of its rows an equilibrium, compiled.

A row is one step of the implicit Euler method as wide as the row: what is faster than the sweep is
at rest at its end, and what remembers - the sides of a loop, the pressure in a port that is shut
tight - goes on from the row before.
"""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.model_run.records import (
    ParametrisedModel,
    Rate,
    Sweep,
    Unknowns,
)
from hil_emulator.identify.prediction.model_run.run import INPUT_COUNT, install
from hil_emulator.identify.prediction.model_run.small_matrices import divide

FINEST = 2.0**-10
"""Least part of a row that is passed by itself (assumed): a current then steps by a millionth of a
sweep of a thousand rows."""


def implicit_step(
    rate: Rate, state: Array, par: Array, inputs: Array, signals: Array, solved: Unknowns,
    width: float,
) -> bool:  # fmt: skip
    """Move the free states by one step of the implicit Euler method, by Newton's method.

    A step is halved while the next one, with the same Jacobian, would be no shorter. It ends where
    a state has its least value: a root of a pressure difference would else be overshot by far.

    Args:
        rate: the model's derivative.
        state: moved in place.
        par: the plant's parameters.
        inputs: of the model.
        signals: overwritten.
        solved: the states that move.
        width: of the step [s].

    Returns:
        Whether the method converged.

    """
    free, scales = solved.places, solved.scales
    count = len(free)
    rates, moved = np.zeros(len(state)), np.zeros(len(state))
    before, step, after = state[free].copy(), np.zeros((count, 1)), np.zeros((count, 1))
    jacobian, work = np.zeros((count, count)), np.zeros((count, count))
    for _ in range(60):
        rate(state, rates, par, inputs, signals)
        step[:, 0] = (before + width * rates[free] - state[free]) / scales
        for j in range(count):
            centre = state[free[j]]
            state[free[j]] = centre + 1e-4 * scales[j]
            rate(state, moved, par, inputs, signals)
            state[free[j]] = centre
            jacobian[:, j] = -width * (moved[free] - rates[free]) / scales * 1e4
            jacobian[j, j] += 1.0
        work[:] = jacobian
        divide(work, step)
        size = np.max(np.abs(step))
        start = state[free].copy()
        part = 1.0
        for _ in range(12):
            state[free] = np.maximum(start + part * scales * step[:, 0], solved.least)
            rate(state, rates, par, inputs, signals)
            after[:, 0] = (before + width * rates[free] - state[free]) / scales
            work[:] = jacobian
            divide(work, after)
            # never true of what is not a number
            if np.max(np.abs(after)) <= (1.0 - 0.25 * part) * size:
                break
            part *= 0.5
        if part * size < 1e-6:
            return True
    return False


def pass_row(
    rate: Rate, state: Array, par: Array, inputs: Array, signals: Array, solved: Unknowns,
    width: float, current: float,
) -> None:  # fmt: skip
    """Move the free states from one row to the next, in parts if one step does not converge.

    A row of which no part converges leaves the state as it was.

    Args:
        rate: the model's derivative.
        state: moved in place.
        par: the plant's parameters.
        inputs: of the model, with the current of the row before; left with that of this row.
        signals: overwritten.
        solved: the states that move.
        width: of the row [s].
        current: of this row [A].

    """
    past, done, part = inputs[0], 0.0, 1.0
    while done < 1.0 and part >= FINEST:
        inputs[0] = past + (done + part) * (current - past)
        before = state.copy()
        if implicit_step(rate, state, par, inputs, signals, solved, part * width):
            done += part
        else:
            state[:] = before
            part *= 0.5
    inputs[0] = current


def sweep(
    model: ParametrisedModel, data: Sweep, start: Array, solved: Unknowns, probes: Index
) -> tuple[Array, Array]:
    """Follow a sweep from row to row.

    Args:
        model: the model at its parameters.
        data: what is given in each row.
        start: state before the first row.
        solved: the states that are solved for.
        probes: indices in `par` of the terms that `data` puts in.

    Returns:
        What the sensors show, shape (rows, channels), and the signals, shape (rows, signals).

    """
    rows = len(data.current)
    track = np.zeros((rows, model.signals))
    signals, inputs = np.zeros(model.signals), np.zeros(INPUT_COUNT)
    # elements meet samples alone
    met = np.empty((0, len(model.sources)))
    instruments = install(model, signals, met, data.period)
    shown = np.zeros((rows, len(instruments.reading)))
    state, par = start.copy(), model.par.copy()
    rates = np.zeros(len(state))
    for k in range(rows):
        par[model.supply] = data.supply[k]
        par[probes] = data.terms[k]
        state[data.places] = data.given[k]
        # before the first row there was time enough
        width = data.period if k > 0 else 1e3
        pass_row(model.rate, state, par, inputs, signals, solved, width, data.current[k])
        model.rate(state, rates, par, inputs, signals)
        model.sense(*instruments)
        shown[k] = instruments.reading
        track[k] = signals
    return shown, track
