"""The loops of the free run, as `filter` has those of the predictor."""

from typing import Any

import numpy as np

from hil_emulator.identify.prediction.filter import INPUT_COUNT, advance


def run_freely(
    tick: Any, sense: Any, start: Any, z0: Any, active: Any, par: Any, drift: int, supply: int,
    chan: Any, remembered: Any, sources: Any, chosen: Any, current: Any, measured: Any,
    gains: Any, decay: Any, period: float, step: float, steps: int, first: int, window: int,
    one: Any, free: Any, track: Any,
) -> None:  # fmt: skip
    """Run the frozen predictor, and beside it the free run that it restarts.

    Arguments as in `filter.predict`, and:
        first: sample of the first restart.
        window: samples between restarts.
        one: errors one step ahead, shape (samples, chosen); overwritten.
        free: errors of the free run; overwritten.
        track: the predictor's signals; overwritten.

    """
    par = par.copy()
    nominal = par[supply]
    z, z_free = z0.copy(), z0.copy()
    memory = np.zeros(6 * len(start))
    memory[: len(start)] = start
    memory_free = memory.copy()
    inputs, normal = np.zeros(INPUT_COUNT), np.zeros(len(sources))
    reading, overrange = np.zeros(len(sources)), np.zeros(len(sources), np.int64)
    past = np.full(remembered[0], np.nan)
    trace = np.full(remembered[1], np.nan)
    history = np.full(remembered[2], np.nan)
    past_free, trace_free, history_free = past.copy(), trace.copy(), history.copy()
    signals = np.zeros(track.shape[1])
    advance(
        tick, memory, past, z, active, par, drift, supply, nominal, inputs, current[0], decay,
        signals, step, 0,
    )  # fmt: skip
    signals_free = signals.copy()
    error = np.zeros(len(chosen))
    for k in range(len(current)):
        if k > first:
            sense(
                signals_free, sources, chan, trace_free, history_free, normal, period, reading,
                overrange,
            )  # fmt: skip
            for i in range(len(chosen)):
                free[k, i] = measured[k, i] - reading[chosen[i]]
        sense(signals, sources, chan, trace, history, normal, period, reading, overrange)
        track[k] = signals
        for i in range(len(chosen)):
            one[k, i] = measured[k, i] - reading[chosen[i]]
            error[i] = one[k, i] if np.isfinite(measured[k, i]) else 0.0
        for i in range(len(z)):
            for j in range(len(chosen)):
                z[i] += gains[k, i, j] * error[j]
        if k >= first and (k - first) % window == 0:
            z_free[:] = z
            memory_free[:] = memory
            past_free[:] = past
            trace_free[:] = trace
            history_free[:] = history
        advance(
            tick, memory, past, z, active, par, drift, supply, nominal, inputs, current[k], decay,
            signals, step, steps,
        )  # fmt: skip
        if k >= first:
            advance(
                tick, memory_free, past_free, z_free, active, par, drift, supply, nominal,
                inputs, current[k], decay, signals_free, step, steps,
            )  # fmt: skip


def carry(
    gains: Any, maps: Any, senses: Any, noise: Any, diffusion: Any, first: int, window: int,
    one: Any, free: Any,
) -> None:  # fmt: skip
    """Carry the covariance of the predictor's error, and of the free run, by source.

    Args:
        gains: see `linearised.linearise`, as the next two.
        maps: see there.
        senses: see there.
        noise: variance of each channel.
        diffusion: variance that each source but the first gives each state in a sample,
            shape (sources - 1, z).
        first: sample of the first restart.
        window: samples between restarts.
        one: variance of the reading's error, shape (sources, samples, channels); overwritten.
        free: the same in the free run; overwritten.

    """
    count, n, m = gains.shape
    sources = len(diffusion) + 1
    cov = np.zeros((sources, n, n))
    loose = np.zeros((sources, n, n))
    for k in range(count - 1):
        if k >= first and (k - first) % window == 0:
            loose[:] = cov
        kept = maps[k] - gains[k + 1] @ senses[k]
        for s in range(sources):
            if s > 0:
                for i in range(n):
                    cov[s, i, i] += diffusion[s - 1, i]
                    loose[s, i, i] += diffusion[s - 1, i]
            seen = senses[k] @ cov[s]
            seen_free = senses[k] @ loose[s]
            for c in range(m):
                one[s, k + 1, c] = np.sum(seen[c] * senses[k, c])
                free[s, k + 1, c] = np.sum(seen_free[c] * senses[k, c])
                if s == 0:
                    one[s, k + 1, c] += noise[c]
                    free[s, k + 1, c] += noise[c]
            cov[s] = kept @ cov[s] @ kept.T
            loose[s] = maps[k] @ loose[s] @ maps[k].T
        for i in range(n):
            for j in range(n):
                for c in range(m):
                    cov[0, i, j] += gains[k + 1, i, c] * noise[c] * gains[k + 1, j, c]
