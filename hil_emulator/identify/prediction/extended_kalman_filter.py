"""The extended Kalman filter that finds the gains."""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Mask, Single
from hil_emulator.identify.prediction.records import (
    Data,
    Gains,
    Jacobians,
    ParametrisedModel,
    Start,
    Tuning,
)
from hil_emulator.identify.prediction.run import (
    Passage,
    advance,
    compare,
    correct,
    elapse,
    enter,
    follow,
)
from hil_emulator.identify.prediction.small_matrices import congruence, multiply, root_of_inverse


class Estimate(NamedTuple):
    """What a filter knows of z, and of one sample.

    Attributes:
        cov: covariance of z.
        widths: steps of the differences by z.
        slope: derivative of the readings by z, shape (chosen, z).
        present: which readings there are.
        seen: rows of `slope` of what was measured; memory for products of that shape.
        spread: the same.
        innovation: covariance of the errors.
        onward: derivative of the next z by the corrected one; memory for `update` until then.
        before: memory for products of that shape.
        work: the same.

    """

    cov: Array
    widths: Array
    slope: Array
    present: Mask
    seen: Array
    spread: Array
    innovation: Array
    onward: Array
    before: Array
    work: Array


def update(estimate: Estimate, noise: Array, held: int, gain: Array, whitening: Array) -> None:
    """Update the covariance by a measurement; fills gain and whitening.

    The covariance takes the form that rounding cannot make negative, and that holds for any gain
    (Joseph): element `held` of z, -1 for none, counts as uncertain but is not corrected (Schmidt).
    """
    cov, slope, present, h, hp = (
        estimate.cov, estimate.slope, estimate.present, estimate.seen, estimate.spread
    )  # fmt: skip
    s, keep, before = estimate.innovation, estimate.onward, estimate.before
    m, n = slope.shape
    for i in range(m):
        for j in range(n):
            h[i, j] = slope[i, j] if present[i] else 0.0
    congruence(h, cov, hp, s)
    for i in range(m):
        s[i, i] += noise[i]
    root_of_inverse(s, whitening)
    multiply(whitening.T, hp, h)
    multiply(h.T, whitening.T, gain)
    if held >= 0:
        for i in range(m):
            gain[held, i] = 0.0
    for i in range(m):
        for j in range(n):
            h[i, j] = slope[i, j] if present[i] else 0.0
    multiply(gain, h, keep)
    for a in range(n):
        for b in range(n):
            keep[a, b] = (1.0 if a == b else 0.0) - keep[a, b]
            before[a, b] = cov[a, b]
    congruence(keep, before, estimate.work, cov)
    for i in range(m):
        for a in range(n):
            for b in range(n):
                cov[a, b] += gain[a, i] * noise[i] * gain[b, i]


def differ(passage: Passage, k: int, estimate: Estimate) -> None:
    """Find the derivative of a sample's readings by z at it."""
    run, moved, data, widths = passage.run, passage.moved, passage.data, estimate.widths
    before = data.current[max(0, k - 1), -1 if k else 0]
    for j in range(len(widths)):
        follow(moved, run)
        moved.z[j] += widths[j]
        advance(moved, moved.steps, before, 0)
        for i in range(len(data.chosen)):
            source = run.sources[data.chosen[i]]
            change = moved.signals[source] - run.signals[source]
            estimate.slope[i, j] = change / widths[j]
    for i in range(len(data.chosen)):
        estimate.present[i] = np.isfinite(data.measured[k, i])


def differ_onward(
    passage: Passage, k: int, estimate: Estimate, maps: Single, senses: Single
) -> None:
    """Find the derivative of the next z and readings by the corrected z of a sample."""
    run, moved, data, widths = passage.run, passage.moved, passage.data, estimate.widths
    for j in range(len(widths)):
        follow(moved, passage.corrected)
        moved.z[j] += widths[j]
        elapse(moved, data.current[k], passage.steps)
        for i in range(len(widths)):
            estimate.onward[i, j] = (moved.z[i] - run.z[i]) / widths[j]
            maps[i, j] = estimate.onward[i, j]
        for i in range(len(data.chosen)):
            source = run.sources[data.chosen[i]]
            senses[i, j] = (moved.signals[source] - run.signals[source]) / widths[j]


def spread(estimate: Estimate, tuning: Tuning, unknown: float, settling: bool) -> None:
    """Carry the covariance to the next sample, whose mean current had a variance of its own."""
    cov, onward, before = estimate.cov, estimate.onward, estimate.before
    n, drift = len(cov), len(cov) - 2
    for i in range(n):
        for j in range(n):
            before[i, j] = cov[i, j]
    congruence(onward, before, estimate.work, cov)
    for i in range(n):
        cov[i, i] += tuning.diffusion[i]
    # another current would have acted as the null's drift does, but only in this period
    for i in range(drift):
        for j in range(drift):
            cov[i, j] += onward[i, drift] * unknown * onward[j, drift]
    if settling:
        for i in range(2):
            cov[i, i] += tuning.covariance[i, i]


def filter_samples(
    passage: Passage, tuning: Tuning, noise: Array, estimate: Estimate, gains: Gains,
    jacobians: Jacobians, predicted: Array,
) -> None:  # fmt: skip
    """Run the filter along a recording; arguments and results as of `linearise`."""
    run, instruments, data = passage.run, passage.instruments, passage.data
    scales, widths, drift = tuning.scales, estimate.widths, len(run.z) - 2
    for k in range(len(data.current)):
        passage.sense(*instruments)
        for j in range(len(widths)):
            predicted[k, j] = run.z[j]
            deviation = np.sqrt(max(estimate.cov[j, j], 0.0))
            widths[j] = min(max(scales[0, j], deviation), scales[1, j])
        differ(passage, k, estimate)
        compare(passage, k)
        held = drift if data.settling[k] else -1
        update(estimate, noise, held, gains.kalman[k], gains.whitening[k])
        correct(run, instruments, gains.kalman[k], passage.error)
        follow(passage.corrected, run)
        elapse(run, data.current[k], passage.steps)
        differ_onward(passage, k, estimate, jacobians.maps[k], jacobians.senses[k])
        spread(estimate, tuning, data.unknown[k], k < tuning.settling)


def linearise(
    model: ParametrisedModel, data: Data, start: Start, tuning: Tuning, noise: Array
) -> tuple[Gains, Jacobians, Array]:
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
    count, n, m = len(data.current), len(start.z), len(data.chosen)
    gains = Gains(np.zeros((count, n, m)), np.zeros((count, m, m)))
    jacobians = Jacobians(np.zeros((count, n, n), np.float32), np.zeros((count, m, n), np.float32))
    predicted = np.zeros((count, n))
    estimate = Estimate(
        tuning.covariance.copy(), tuning.scales[0].copy(), np.zeros((m, n)), np.ones(m, np.bool_),
        np.zeros((m, n)), np.zeros((m, n)), np.zeros((m, m)), np.zeros((n, n)),
        np.zeros((n, n)), np.zeros((n, n)),
    )  # fmt: skip
    passage = enter(model, data, start)
    filter_samples(passage, tuning, noise, estimate, gains, jacobians, predicted)
    return gains, jacobians, predicted
