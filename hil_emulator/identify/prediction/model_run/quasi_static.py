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


def implicit_step(
    rate: Rate, state: Array, par: Array, inputs: Array, signals: Array, solved: Unknowns,
    width: float,
) -> None:  # fmt: skip
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

    """
    free, scales = solved.places, solved.scales
    count = len(free)
    rates, moved = np.zeros(len(state)), np.zeros(len(state))
    before, here = state[free].copy(), np.zeros(count)
    jacobian = np.zeros((count, count))
    for _ in range(60):
        rate(state, rates, par, inputs, signals)
        here[:] = (state[free] - before - width * rates[free]) / scales
        for j in range(count):
            centre = state[free[j]]
            state[free[j]] = centre + 1e-4 * scales[j]
            rate(state, moved, par, inputs, signals)
            state[free[j]] = centre
            jacobian[:, j] = -width * (moved[free] - rates[free]) / scales * 1e4
            jacobian[j, j] += 1.0
        step = -np.linalg.solve(jacobian, here)
        size = np.max(np.abs(step))
        start = state[free].copy()
        part = 1.0
        for _ in range(12):
            state[free] = np.maximum(start + part * scales * step, solved.least)
            rate(state, rates, par, inputs, signals)
            here[:] = (state[free] - before - width * rates[free]) / scales
            if np.max(np.abs(np.linalg.solve(jacobian, here))) <= (1.0 - 0.25 * part) * size:
                break
            part *= 0.5
        if part * size < 1e-6:
            break


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
        inputs[0] = data.current[k]
        par[model.supply] = data.supply[k]
        par[probes] = data.terms[k]
        state[data.places] = data.given[k]
        # before the first row there was time enough
        width = data.period if k > 0 else 1e3
        implicit_step(model.rate, state, par, inputs, signals, solved, width)
        model.rate(state, rates, par, inputs, signals)
        model.sense(*instruments)
        shown[k] = instruments.reading
        track[k] = signals
    return shown, track
