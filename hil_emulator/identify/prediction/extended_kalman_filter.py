"""The extended Kalman filter that finds the gains."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Mask
from hil_emulator.identify.prediction.records import (
    Data,
    Gains,
    Jacobians,
    ParametrisedModel,
    Start,
    Tuning,
)
from hil_emulator.identify.prediction.run import (
    Sense,
    advance,
    begin,
    beside,
    correct,
    elapse,
    follow,
    install,
)


def root_of_inverse(s: Array, root: Array) -> None:
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


def multiply(a: Array, b: Array, out: Array) -> None:
    """Fill a b: for matrices this small, a call of a library takes longer than the product."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[k, j]
            out[i, j] = total


def congruence(a: Array, b: Array, work: Array, out: Array) -> None:
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
    cov: Array, slope: Array, noise: Array, present: Mask, held: int, gain: Array, whitening: Array
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
    sense: Sense, model: ParametrisedModel, data: Data, start: Start, tuning: Tuning,
    noise: Array,
) -> tuple[Gains, Jacobians, Array]:  # fmt: skip
    """Run the extended Kalman filter with a Jacobian by forward differences.

    Arguments as in `filter.predict`, and:
        tuning: what it takes for granted. A difference is as long as the deviation of z, between
            the smallest and the largest step, so that a bent law counts by its secant. What a dead
            time still held when the recording began is not known: the spool settles. The null,
            which samples that count for nothing would teach, waits for those that do.
        noise: variance of each chosen channel.

    Returns:
        Gains, Jacobians, and z as it was predicted for each sample, shape (samples, z).

    """
    current, measured, chosen, sources = data.current, data.measured, data.chosen, model.sources
    count, n, m = len(current), len(start.z), len(chosen)
    drift = n - 2
    gains = Gains(np.zeros((count, n, m)), np.zeros((count, m, m)))
    jacobians = Jacobians(np.zeros((count, n, n), np.float32), np.zeros((count, m, n), np.float32))
    kalman, maps, senses = gains.kalman, jacobians.maps, jacobians.senses
    predicted = np.zeros((count, n))
    run = begin(model, start, current[0])
    instruments = install(model, run.signals, run.path, data.period)
    corrected, moved = beside(run), beside(run)
    z, cov, signals = run.z, tuning.covariance.copy(), run.signals
    present = np.ones(m, np.bool_)
    reading_slope = np.zeros((m, n))
    error = np.zeros(m)
    scales = tuning.scales
    widths = scales[0].copy()
    work, before_step, onward = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for k in range(count):
        sense(*instruments)
        predicted[k] = z
        before = current[max(0, k - 1), -1 if k else 0]
        for j in range(n):
            spread = np.sqrt(max(cov[j, j], 0.0))
            widths[j] = min(max(scales[0, j], spread), scales[1, j])
        for j in range(n):  # Jacobian of the reading
            follow(moved, run)
            moved.z[j] += widths[j]
            advance(moved, moved.path, before, 0)
            for i in range(m):
                source = sources[chosen[i]]
                reading_slope[i, j] = (moved.signals[source] - signals[source]) / widths[j]
        for i in range(m):
            present[i] = np.isfinite(measured[k, i])
            error[i] = measured[k, i] - instruments.reading[chosen[i]] if present[i] else 0.0
        held = drift if data.settling[k] else -1
        update(cov, reading_slope, noise, present, held, kalman[k], gains.whitening[k])
        correct(run, instruments, kalman[k], error)
        follow(corrected, run)
        elapse(run, current[k], model.steps)
        for j in range(n):  # Jacobian of the next state and reading
            follow(moved, corrected)
            moved.z[j] += widths[j]
            elapse(moved, current[k], model.steps)
            for i in range(n):
                onward[i, j] = (moved.z[i] - z[i]) / widths[j]
            for i in range(m):
                source = sources[chosen[i]]
                senses[k, i, j] = (moved.signals[source] - signals[source]) / widths[j]
        maps[k] = onward
        before_step[:, :] = cov
        congruence(onward, before_step, work, cov)
        for i in range(n):
            cov[i, i] += tuning.diffusion[i]
        # another current would have acted as the null's drift does, but only in this period
        for i in range(drift):
            for j in range(drift):
                cov[i, j] += onward[i, drift] * data.unknown[k] * onward[j, drift]
        if k < tuning.settling:
            for i in range(2):
                cov[i, i] += tuning.covariance[i, i]
    return gains, jacobians, predicted
