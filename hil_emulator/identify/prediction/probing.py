"""What a small term in a balance does to the innovations: along the base trajectory, linearly."""

from typing import Any

import numpy as np

from hil_emulator.identify.prediction.filter import INPUT_COUNT, advance


def probe(
    tick: Any, sense: Any, start: Any, z0: Any, active: Any, par: Any, drift: int, supply: int,
    probes: Any, sizes: Any, chan: Any, remembered: Any, sources: Any, chosen: Any,
    signal_count: int, current: Any, measured: Any, gains: Any, decay: Any, period: float,
    step: float, steps: int, drives: Any, feeds: Any,
) -> None:  # fmt: skip
    """Run the frozen predictor and derive each of its steps by the probes.

    Arguments as in `filter.predict`, and:
        probes: parameters whose effect on the next state is wanted.
        sizes: step of their differences.
        signal_count: number of the model's signals.
        drives, feeds: the result: Jacobians of the next z and the next reading, per sample.

    """
    par = par.copy()
    nominal = par[supply]
    n, m, size = len(z0), len(chosen), len(start)
    z, moved = z0.copy(), z0.copy()
    memory = np.zeros(6 * size)
    memory[:size] = start
    other = memory.copy()
    inputs = np.zeros(INPUT_COUNT)
    normal = np.zeros(len(sources))
    reading = np.zeros(len(sources))
    overrange = np.zeros(len(sources), np.int64)
    past = np.full(remembered[0], np.nan)
    past_other = past.copy()
    trace = np.full(remembered[1], np.nan)
    history = np.full(remembered[2], np.nan)
    signals = np.zeros(signal_count)
    signals_moved = signals.copy()
    past_before, before, posterior = past.copy(), memory.copy(), z.copy()
    advance(
        tick, memory, past, z, active, par, drift, supply, nominal, inputs, current[0], decay,
        signals, step, 0,
    )  # fmt: skip
    for k in range(len(current)):
        sense(signals, sources, chan, trace, history, normal, period, reading, overrange)
        for j in range(m):
            error = measured[k, j] - reading[chosen[j]]
            if np.isfinite(error):
                for i in range(n):
                    z[i] += gains[k, i, j] * error
        before[:] = memory
        past_before[:] = past
        posterior[:] = z
        advance(
            tick, memory, past, z, active, par, drift, supply, nominal, inputs, current[k], decay,
            signals, step, steps,
        )  # fmt: skip
        for j in range(len(probes)):
            moved[:] = posterior
            other[:] = before
            past_other[:] = past_before
            par[probes[j]] += sizes[j]
            advance(
                tick, other, past_other, moved, active, par, drift, supply, nominal, inputs,
                current[k], decay, signals_moved, step, steps,
            )  # fmt: skip
            par[probes[j]] -= sizes[j]
            for i in range(n):
                drives[k, i, j] = (moved[i] - z[i]) / sizes[j]
            for i in range(m):
                source = sources[chosen[i]]
                feeds[k, i, j] = (signals_moved[source] - signals[source]) / sizes[j]


def propagate(
    gains: Any, whitening: Any, maps: Any, senses: Any, drives: Any, feeds: Any, inputs: Any,
    outputs: Any, column: Any,
) -> None:  # fmt: skip
    """Fill a residual's derivative by a small term that acts along the base trajectory.

    What comes first is from `linearised.linearise`, drives and feeds from `probe`, and:
        inputs: what the term adds to each probe, shape (samples, probes).
        outputs: what it adds to each reading, shape (samples, chosen).
        column: derivative of the whitened innovations, shape (samples, chosen); overwritten.

    """
    n, m = gains.shape[1], gains.shape[2]
    dz = np.zeros(n)
    after = np.zeros(n)
    dy = np.zeros(m)
    for k in range(len(column)):
        for i in range(m):
            dy[i] += outputs[k, i]
        for i in range(m):
            column[k, i] = 0.0
            for j in range(m):
                column[k, i] -= whitening[k, j, i] * dy[j]
        for i in range(n):
            for j in range(m):
                dz[i] -= gains[k, i, j] * dy[j]
        after[:] = 0.0
        for i in range(n):
            for j in range(n):
                after[i] += maps[k, i, j] * dz[j]
            for j in range(inputs.shape[1]):
                after[i] += drives[k, i, j] * inputs[k, j]
        for i in range(m):
            dy[i] = 0.0
            for j in range(n):
                dy[i] += senses[k, i, j] * dz[j]
            for j in range(inputs.shape[1]):
                dy[i] += feeds[k, i, j] * inputs[k, j]
        dz[:] = after
