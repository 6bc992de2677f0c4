"""The extended Kalman filter that finds the gains."""

from typing import Any

import numpy as np

from hil_emulator.identify.prediction.filter import INPUT_COUNT, advance


def root_of_inverse(s: Any, root: Any) -> None:
    """Fill the lower triangular L with S^-1 = L L^T, for a positive definite S; overwrites S."""
    m = len(s)
    # S = U U^T from the last row upwards, with U upper triangular; then L = U^-T
    for j in range(m - 1, -1, -1):
        for k in range(j + 1, m):
            s[j, j] -= s[j, k] ** 2
        s[j, j] = np.sqrt(s[j, j])
        for i in range(j):
            for k in range(j + 1, m):
                s[i, j] -= s[i, k] * s[j, k]
            s[i, j] /= s[j, j]
    root[:, :] = 0.0
    for i in range(m):
        root[i, i] = 1.0 / s[i, i]
        for j in range(i):
            for k in range(j, i):
                root[i, j] -= s[k, i] * root[k, j]
            root[i, j] /= s[i, i]


def multiply(a: Any, b: Any, out: Any) -> None:
    """Fill a b: for matrices this small, a call of a library takes longer than the product."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[k, j]
            out[i, j] = total


def congruence(a: Any, b: Any, work: Any, out: Any) -> None:
    """Fill a b a^T of a symmetric b; `work` has the shape of a."""
    multiply(a, b, work)
    for i in range(a.shape[0]):
        for j in range(i + 1):
            total = 0.0
            for k in range(a.shape[1]):
                total += work[i, k] * a[j, k]
            out[i, j] = total
            out[j, i] = total


def update(
    cov: Any, slope: Any, noise: Any, present: Any, held: int, gain: Any, whitening: Any
) -> None:
    """Update the covariance by a measurement; fills gain and whitening.

    The covariance takes the form that rounding cannot make negative, and that holds for any gain
    (Joseph): element `held` of z, -1 for none, counts as uncertain but is not corrected (Schmidt).
    """
    m, n = slope.shape
    h, s, hp = slope.copy(), np.zeros((m, m)), np.zeros((m, n))
    for i in range(m):
        if not present[i]:
            h[i, :] = 0.0
    congruence(h, cov, hp, s)
    for i in range(m):
        s[i, i] += noise[i]
    root_of_inverse(s, whitening)
    multiply(whitening.T, hp, h)
    multiply(h.T, whitening.T, gain)
    if held >= 0:
        gain[held, :] = 0.0
    keep, before, work = np.zeros((n, n)), cov.copy(), np.zeros((n, n))
    for i in range(m):
        for j in range(n):
            h[i, j] = slope[i, j] if present[i] else 0.0
    multiply(gain, h, keep)
    for a in range(n):
        for b in range(n):
            keep[a, b] = (1.0 if a == b else 0.0) - keep[a, b]
    congruence(keep, before, work, cov)
    for i in range(m):
        for a in range(n):
            for b in range(n):
                cov[a, b] += gain[a, i] * noise[i] * gain[b, i]


def linearise(
    tick: Any, sense: Any, start: Any, z0: Any, cov0: Any, scales: Any, active: Any, par: Any,
    drift: int, supply: int, chan: Any, remembered: Any, sources: Any, chosen: Any, slope: Any,
    signal_count: int, current: Any, measured: Any, noise: Any, diffusion: Any, decay: Any,
    settling: int, burn_in: int, period: float, step: float, steps: int, gains: Any,
    whitening: Any, maps: Any, senses: Any,
) -> None:  # fmt: skip
    """Run the extended Kalman filter with a Jacobian by forward differences.

    Arguments as in `filter.predict`, and:
        cov0: covariance of z0.
        scales: smallest and largest step of the differences, by element of z, shape (2, z); in
            between it is the deviation of z, so that a bent law counts by its secant.
        slope: reading per signal of each chosen channel.
        signal_count: number of the model's signals.
        noise: variance of each chosen channel.
        diffusion: variance that z gains in a sample.
        settling: samples for which the spool, the first two of z, is as uncertain as at first:
            what a dead time still held when the recording began is not known.
        burn_in: samples that count for nothing: the null, which they would teach, waits for those
            that do.
        gains, whitening: the result; see `filter.predict`.
        maps, senses: Jacobians of the next z and the next reading by z, per sample.

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
    widths = scales[0].copy()
    still = np.ones(2)
    moved = z.copy()
    other = memory.copy()
    work, before_step = np.zeros((n, n)), np.zeros((n, n))
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
        for j in range(n):
            spread = np.sqrt(max(cov[j, j], 0.0))
            widths[j] = min(max(scales[0, j], spread), scales[1, j])
        for j in range(n):  # Jacobian of the reading
            moved[:] = z
            moved[j] += widths[j]
            other[:] = memory
            past_other[:] = past
            advance(
                tick, other, past_other, moved, active, par, drift, supply, nominal, inputs, before,
                still, signals_moved, step, 0,
            )  # fmt: skip
            for i in range(m):
                source = sources[chosen[i]]
                reading_slope[i, j] = (
                    slope[i] * (signals_moved[source] - signals[source]) / widths[j]
                )
        for i in range(m):
            present[i] = np.isfinite(measured[k, i])
            error[i] = measured[k, i] - reading[chosen[i]] if present[i] else 0.0
        held = n - 2 if k < burn_in else -1
        update(cov, reading_slope, noise, present, held, gains[k], whitening[k])
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
            moved[j] += widths[j]
            other[:] = old
            past_other[:] = past_before
            advance(
                tick, other, past_other, moved, active, par, drift, supply, nominal, inputs,
                current[k], decay, signals_moved, step, steps,
            )  # fmt: skip
            for i in range(n):
                maps[k, i, j] = (moved[i] - z[i]) / widths[j]
            for i in range(m):
                source = sources[chosen[i]]
                senses[k, i, j] = slope[i] * (signals_moved[source] - signals[source]) / widths[j]
        before_step[:, :] = cov
        congruence(maps[k], before_step, work, cov)
        for i in range(n):
            cov[i, i] += diffusion[i]
        if k < settling:
            for i in range(2):
                cov[i, i] += cov0[i, i]
