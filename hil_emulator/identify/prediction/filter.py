"""The predictor: a Kalman filter through the compiled model, and its frozen repetition.

Innovations of a predictor with process noise are immune to slow drift, which free-running
simulation adds up to many times the sensors' noise. The gains are computed once per fit and then
frozen, so that the innovations are an ordinary function of the parameters.

Every function takes the kernel's `tick` and `sense` as its first arguments. The augmented state z
is the model's active states, then two Ornstein-Uhlenbeck disturbances: null drift of the valve [A]
and deviation of the supply pressure [Pa].
"""

from typing import Any

import numpy as np

from hil_emulator.model.quantities import INPUTS

DISTURBANCES = 2
"""Null drift and supply deviation."""

INPUT_COUNT = len(INPUTS)
"""Inputs of the model; the first is the valve current."""


def advance(
    tick: Any, memory: Any, past: Any, z: Any, active: Any, par: Any, drift: int, supply: int,
    nominal: float, inputs: Any, current: float, decay: Any, signals: Any, step: float, steps: int,
) -> None:  # fmt: skip
    """Map z over one sample period; `memory` and `signals` then belong to the new state."""
    n = len(active)
    for i in range(n):
        memory[active[i]] = z[i]
    z[n] *= decay[0]
    z[n + 1] *= decay[1]
    inputs[0] = current
    par[drift] = z[n]
    par[supply] = nominal + z[n + 1]
    tick(memory, past, par, inputs, signals, step, steps)
    for i in range(n):
        z[i] = memory[active[i]]


def predict(
    tick: Any, sense: Any, start: Any, z0: Any, active: Any, par: Any, drift: int, supply: int,
    chan: Any, remembered: Any, sources: Any, chosen: Any, current: Any, measured: Any, gains: Any,
    whitening: Any, decay: Any, period: float, step: float, steps: int, residual: Any, track: Any,
) -> None:  # fmt: skip
    """Run the frozen predictor.

    Args:
        tick: the kernel's integration over one sample.
        sense: the kernel's sensor chain.
        start: state vector at the start, of all states.
        z0: augmented state at the start.
        active: indices of the states in z.
        par: the plant's parameters.
        drift: index of the null's drift in `par`.
        supply: index of the supply pressure in `par`.
        chan: the transducers' parameters.
        remembered: how many values the set point, the transducers, and their histories remember.
        sources: index of each channel's signal.
        chosen: the channels that were measured.
        current: valve current per sample [A].
        measured: readings, shape (samples, chosen), NaN where missing.
        gains: Kalman gains, shape (samples, z, chosen).
        whitening: L with S^-1 = L L^T, shape (samples, chosen, chosen).
        decay: what remains of the disturbances after a sample.
        period: sample period [s].
        step: integration step [s].
        steps: steps per sample.
        residual: whitened innovations, shape (samples, chosen); overwritten.
        track: predicted signals, shape (samples, signals); overwritten, unless it is empty.

    """
    par = par.copy()
    nominal = par[supply]
    z = z0.copy()
    memory = np.zeros(6 * len(start))
    memory[: len(start)] = start
    inputs = np.zeros(INPUT_COUNT)
    normal = np.zeros(len(sources))
    reading = np.zeros(len(sources))
    overrange = np.zeros(len(sources), np.int64)
    past = np.full(remembered[0], np.nan)
    trace = np.full(remembered[1], np.nan)
    history = np.full(remembered[2], np.nan)
    signals = np.zeros(track.shape[1])
    advance(
        tick,
        memory,
        past,
        z,
        active,
        par,
        drift,
        supply,
        nominal,
        inputs,
        current[0],
        decay,
        signals,
        step,
        0,
    )
    m = len(chosen)
    error = np.zeros(m)
    for k in range(len(current)):
        sense(signals, sources, chan, trace, history, normal, period, reading, overrange)
        for i in range(m):
            error[i] = measured[k, i] - reading[chosen[i]]
            if not np.isfinite(measured[k, i]):
                error[i] = 0.0
        for i in range(m):
            residual[k, i] = 0.0
            for j in range(m):
                residual[k, i] += whitening[k, j, i] * error[j]
        if len(track) > 1:
            track[k] = signals
        for i in range(len(z)):
            for j in range(m):
                z[i] += gains[k, i, j] * error[j]
        advance(
            tick, memory, past, z, active, par, drift, supply, nominal, inputs, current[k], decay,
            signals, step, steps,
        )  # fmt: skip
