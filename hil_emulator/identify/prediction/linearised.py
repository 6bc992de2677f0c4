"""The extended Kalman filter that finds the gains, and what it leaves for linear columns."""

from typing import Any

import numpy as np

from hil_emulator.identify.prediction.filter import INPUT_COUNT, advance


def update(cov: Any, slope: Any, noise: Any, present: Any, gain: Any, whitening: Any) -> Any:
    """Return the covariance after a measurement; fills gain and whitening."""
    m, n = slope.shape
    h = slope.copy()
    for i in range(m):
        if not present[i]:
            h[i, :] = 0.0
    s = h @ cov @ h.T
    for i in range(m):
        s[i, i] += noise[i]
    inverse = np.linalg.inv(s)
    k = cov @ h.T @ inverse
    gain[:, :] = k
    whitening[:, :] = np.linalg.cholesky(0.5 * (inverse + inverse.T))
    keep = np.eye(n) - k @ h
    out = keep @ cov @ keep.T
    for i in range(m):
        for a in range(n):
            for b in range(n):
                out[a, b] += k[a, i] * noise[i] * k[b, i]
    return out


def linearise(
    tick: Any, sense: Any, start: Any, z0: Any, cov0: Any, scales: Any, active: Any, par: Any,
    drift: int, supply: int, probes: Any, probe_sizes: Any, chan: Any, remembered: Any,
    sources: Any, chosen: Any, slope: Any, signal_count: int, current: Any, measured: Any,
    noise: Any, diffusion: Any, decay: Any, period: float, step: float, steps: int, gains: Any,
    whitening: Any, maps: Any, senses: Any,
    drives: Any, feeds: Any,
) -> None:  # fmt: skip
    """Run the extended Kalman filter with a Jacobian by forward differences.

    Arguments as in `filter.predict`, and:
        cov0: covariance of z0.
        scales: step of the differences, by element of z.
        probes: parameters whose effect on the next state is wanted.
        probe_sizes: step of their differences.
        slope: reading per signal of each chosen channel.
        signal_count: number of the model's signals.
        noise: variance of each chosen channel.
        diffusion: variance that z gains in a sample.
        gains, whitening: the result; see `filter.predict`.
        maps, senses: Jacobians of the next z and the next reading by z, per sample.
        drives, feeds: the same by the probes.

    """
    par = par.copy()
    nominal = par[supply]
    n, m, size = len(z0), len(chosen), len(start)
    z, cov = z0.copy(), cov0.copy()
    memory = np.zeros(6 * size)
    memory[:size] = start
    inputs = np.zeros(INPUT_COUNT)
    normal = np.zeros(len(sources))
    reading = np.zeros(len(sources))
    overrange = np.zeros(len(sources), np.int64)
    past = np.full(remembered[0], np.nan)
    past_before = past.copy()
    past_other = past.copy()
    trace = np.full(remembered[1], np.nan)
    history = np.full(remembered[2], np.nan)
    signals = np.zeros(signal_count)
    signals_moved = signals.copy()
    present = np.ones(m, np.bool_)
    reading_slope = np.zeros((m, n))
    error = np.zeros(m)
    still = np.ones(2)
    moved = z.copy()
    other = memory.copy()
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
        still,
        signals,
        step,
        0,
    )
    for k in range(len(current)):
        sense(signals, sources, chan, trace, history, normal, period, reading, overrange)
        before = current[max(0, k - 1)]
        for j in range(n):  # Jacobian of the reading
            moved[:] = z
            moved[j] += scales[j]
            other[:] = memory
            past_other[:] = past
            advance(
                tick, other, past_other, moved, active, par, drift, supply, nominal, inputs, before,
                still, signals_moved, step, 0,
            )  # fmt: skip
            for i in range(m):
                source = sources[chosen[i]]
                reading_slope[i, j] = (
                    slope[i] * (signals_moved[source] - signals[source]) / scales[j]
                )
        for i in range(m):
            present[i] = np.isfinite(measured[k, i])
            error[i] = measured[k, i] - reading[chosen[i]] if present[i] else 0.0
        cov = update(cov, reading_slope, noise, present, gains[k], whitening[k])
        for i in range(n):
            for j in range(m):
                z[i] += gains[k, i, j] * error[j]
        old = memory.copy()
        past_before[:] = past
        posterior = z.copy()
        advance(
            tick, memory, past, z, active, par, drift, supply, nominal, inputs, current[k], decay,
            signals, step, steps,
        )  # fmt: skip
        for j in range(n):  # Jacobian of the next state and reading
            moved[:] = posterior
            moved[j] += scales[j]
            other[:] = old
            past_other[:] = past_before
            advance(
                tick, other, past_other, moved, active, par, drift, supply, nominal, inputs,
                current[k], decay, signals_moved, step, steps,
            )  # fmt: skip
            for i in range(n):
                maps[k, i, j] = (moved[i] - z[i]) / scales[j]
            for i in range(m):
                source = sources[chosen[i]]
                senses[k, i, j] = slope[i] * (signals_moved[source] - signals[source]) / scales[j]
        for j in range(len(probes)):
            moved[:] = posterior
            other[:] = old
            past_other[:] = past_before
            par[probes[j]] += probe_sizes[j]
            advance(
                tick, other, past_other, moved, active, par, drift, supply, nominal, inputs,
                current[k], decay, signals_moved, step, steps,
            )  # fmt: skip
            par[probes[j]] -= probe_sizes[j]
            for i in range(n):
                drives[k, i, j] = (moved[i] - z[i]) / probe_sizes[j]
            for i in range(m):
                source = sources[chosen[i]]
                feeds[k, i, j] = (
                    slope[i] * (signals_moved[source] - signals[source]) / probe_sizes[j]
                )
        cov = maps[k] @ cov @ maps[k].T
        for i in range(n):
            cov[i, i] += diffusion[i]


def propagate(
    gains: Any, whitening: Any, maps: Any, senses: Any, drives: Any, feeds: Any, inputs: Any,
    outputs: Any, column: Any,
) -> None:  # fmt: skip
    """Fill a residual's derivative by a small term that acts along the base trajectory.

    Args:
        gains: from `linearise`, as the next five.
        whitening: see there.
        maps: see there.
        senses: see there.
        drives: see there.
        feeds: see there.
        inputs: what the term adds to each probe, shape (samples, probes).
        outputs: what it adds to each reading, shape (samples, chosen).
        column: derivative of the whitened innovations, shape (samples, chosen); overwritten.

    """
    n, m = gains.shape[1], gains.shape[2]
    dz = np.zeros(n)
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
        dy = senses[k] @ dz + feeds[k] @ inputs[k]
        dz = maps[k] @ dz + drives[k] @ inputs[k]
