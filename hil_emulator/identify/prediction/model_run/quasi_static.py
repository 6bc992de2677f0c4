"""Slow sweep with rows in equilibrium, compiled.

Each row is one step of the implicit Euler method over its duration. States faster than the sweep
reach equilibrium; states with memory, such as a hysteresis or the pressure in a blocked port,
continue from the row before.
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
"""Smallest substep, as a share of a row (assumed): one millionth of a sweep of 1000 rows."""


def implicit_step(
    rate: Rate, state: Array, par: Array, inputs: Array, signals: Array, solved: Unknowns,
    width: float,
) -> bool:  # fmt: skip
    """Advance the unknown states by one step of the implicit Euler method.

    Damped Newton method with a natural monotonicity test: a step is halved until the next
    simplified step is shorter. States are limited to their smallest value, since the root of a
    pressure difference may be overshot by far.

    Args:
        rate: derivative of the model's state.
        state: updated in place.
        par: parameters of the plant.
        inputs: of the model.
        signals: overwritten.
        solved: unknown states.
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
            # False for NaN
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
    """Advance the unknown states to the next row, in substeps if one step does not converge.

    The state is unchanged if no substep converges.

    Args:
        rate: derivative of the model's state.
        state: updated in place.
        par: parameters of the plant.
        inputs: of the model, with the current of the row before; set to that of this row.
        signals: overwritten.
        solved: unknown states.
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
    """Compute a sweep from row to row.

    Args:
        model: with its parameters.
        data: inputs of each row.
        start: state before the first row.
        solved: unknown states.
        probes: indices in `par` of the terms in `data`.

    Returns:
        Readings, shape (rows, channels), and signals, shape (rows, signals).

    """
    rows = len(data.current)
    track = np.zeros((rows, model.signals))
    signals, inputs = np.zeros(model.signals), np.zeros(INPUT_COUNT)
    # sensor inputs are constant within a row
    no_path = np.empty((0, len(model.sources)))
    instruments = install(model, signals, no_path, data.period)
    shown = np.zeros((rows, len(instruments.reading)))
    state, par = start.copy(), model.par.copy()
    rates = np.zeros(len(state))
    for k in range(rows):
        par[model.supply] = data.supply[k]
        par[probes] = data.terms[k]
        state[data.places] = data.given[k]
        # the first row starts in equilibrium
        width = data.period if k > 0 else 1e3
        pass_row(model.rate, state, par, inputs, signals, solved, width, data.current[k])
        model.rate(state, rates, par, inputs, signals)
        model.sense(*instruments)
        shown[k] = instruments.reading
        track[k] = signals
    return shown, track
