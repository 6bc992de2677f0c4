"""The extended Kalman filter that finds the gains."""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index, Mask
from hil_emulator.identify.prediction.filter.sample_jacobian import (
    elapse_linearly,
    note,
    read_widely,
)
from hil_emulator.identify.prediction.filter.transition import Slopes, differentiate, slopes_of
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Gains,
    Jacobians,
    ParametrisedModel,
    Start,
    Tuning,
)
from hil_emulator.identify.prediction.model_run.run import Passage, compare, correct, enter
from hil_emulator.identify.prediction.model_run.small_matrices import (
    congruence,
    copy,
    duplicate,
    multiply,
    root_of_inverse,
)


class Estimate(NamedTuple):
    """What a filter knows of z, and of one sample.

    Attributes:
        cov: covariance of z.
        present: which readings there are.
        seen: derivative by z of the readings that were measured; memory for that shape.
        spread: the same.
        innovation: covariance of the errors.
        before: memory for products of covariances.
        work: the same.
        gain: of the sample's measurement.
        whitening: L with S^-1 = L L^T of that.

    """

    cov: Array
    present: Mask
    seen: Array
    spread: Array
    innovation: Array
    before: Array
    work: Array
    gain: Array
    whitening: Array


def estimate_of(covariance: Array, chosen: int) -> Estimate:
    """Return what a filter knows at its start."""
    n, m = len(covariance), chosen
    return Estimate(
        covariance.copy(), np.ones(m, np.bool_), np.zeros((m, n)), np.zeros((m, n)),
        np.zeros((m, m)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, m)), np.zeros((m, m)),
    )  # fmt: skip


def update(estimate: Estimate, slope: Array, noise: Array, held: int) -> None:
    """Update the covariance by a measurement, whose gain and whitening are kept in the estimate.

    Element `held` of z, -1 for none, counts as uncertain but is not corrected (Schmidt): it keeps
    its variance, and all else is as if it were corrected. `slope` is the derivative of the readings
    by z.
    """
    cov, present, h, hp = estimate.cov, estimate.present, estimate.seen, estimate.spread
    s, (m, n) = estimate.innovation, slope.shape
    gain, whitening = estimate.gain, estimate.whitening
    for i in range(m):
        for j in range(n):
            h[i, j] = slope[i, j] if present[i] else 0.0
    congruence(h, cov, hp, s)
    for i in range(m):
        s[i, i] += noise[i]
    root_of_inverse(s, whitening)
    # S^-1 = L L^T: what is told is the square of L^T H P
    multiply(whitening.T, hp, h)
    multiply(h.T, whitening.T, gain)
    for a in range(n):
        for b in range(a + 1):
            told = 0.0
            for i in range(m):
                told += h[i, a] * h[i, b]
            if a != held or b != held:
                cov[a, b] -= told
                cov[b, a] = cov[a, b]
    if held >= 0:
        for i in range(m):
            gain[held, i] = 0.0


def spread(
    estimate: Estimate, onward: Array, tuning: Tuning, unknown: float, settling: bool
) -> None:
    """Carry the covariance to the next sample, whose mean current had a variance of its own."""
    cov, before = estimate.cov, estimate.before
    n, drift = len(cov), len(cov) - 2
    duplicate(cov, before)
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
    passage: Passage, tuning: Tuning, noise: Array, estimate: Estimate, slopes: Slopes,
    gains: Gains, jacobians: Jacobians, predicted: Array,
) -> None:  # fmt: skip
    """Run the filter along a recording; arguments and results as of `linearise`.

    Where z is to be predicted, gains are found, and by given ones the model is corrected otherwise.
    """
    run, instruments, data = passage.run, passage.instruments, passage.data
    first, finds = slopes.onward.shape[1] - jacobians.maps.shape[2], len(predicted) > 0
    differentiate(passage, slopes)
    if finds:
        slopes.secant[0] = tuning.secant[0]
        read_widely(passage, slopes)
    for k in range(len(data.current)):
        passage.sense(*instruments)
        compare(passage, k)
        if finds:
            copy(run.z, predicted[k])
            measure(data, k, tuning, noise, estimate, slopes)
            duplicate(estimate.gain, gains.kalman[k])
            duplicate(estimate.whitening, gains.whitening[k])
        correct(run, instruments, gains.kalman[k], passage.error)
        elapse_linearly(passage, k, slopes)
        note(slopes, first, jacobians.maps[k], jacobians.senses[k])
        if finds:
            read_widely(passage, slopes)
            spread(estimate, slopes.onward, tuning, data.unknown[k], k < tuning.settling)


def measure(
    data: Data, k: int, tuning: Tuning, noise: Array, estimate: Estimate, slopes: Slopes
) -> None:
    """Learn what a sample tells."""
    set_secant(slopes, estimate, tuning)
    for i in range(len(data.chosen)):
        estimate.present[i] = np.isfinite(data.measured[k, i])
    held = len(estimate.cov) - 2 if data.settling[k] else -1
    update(estimate, slopes.readings, noise, held)


def set_secant(slopes: Slopes, estimate: Estimate, tuning: Tuning) -> None:
    """Make the secant of the velocity as wide as that is uncertain, within bounds."""
    deviation = np.sqrt(max(estimate.cov[slopes.speed, slopes.speed], 0.0))
    slopes.secant[0] = min(max(tuning.secant[0], deviation), tuning.secant[1])


def linearise(
    model: ParametrisedModel, data: Data, start: Start, tuning: Tuning, noise: Array,
    gains: Gains, predicted: Array, probes: Index,
) -> Jacobians:  # fmt: skip
    """Run the extended Kalman filter, with Jacobians as of `elapse_linearly`.

    Arguments as in `innovations.predict`, and:
        tuning: what it takes for granted. The secant of the velocity is as wide as its deviation,
            within bounds. What a dead time still held when the recording began is not known: the
            spool settles. The null, which samples that count for nothing would teach, waits for
            those that do.
        noise: variance of each chosen channel.
        gains: overwritten, unless nothing is predicted.
        predicted: z as it was predicted for each sample, shape (samples, z); overwritten. Without
            rows, the run is repeated with the gains.
        probes: parameters by which Jacobians are wanted; none stand for z.

    """
    count, n, m = len(data.current), len(start.z), len(data.chosen)
    wanted = len(probes) if len(probes) > 0 else n
    jacobians = Jacobians(
        np.zeros((count, n, wanted), np.float32), np.zeros((count, m, wanted), np.float32)
    )
    places = np.zeros(2 + len(probes), np.int64)
    places[0], places[1] = model.drift, model.supply
    for i in range(len(probes)):
        places[2 + i] = probes[i]
    slopes = slopes_of(model, start, data, places, tuning.widths)
    filter_samples(
        enter(model, data, start), tuning, noise, estimate_of(tuning.covariance, m), slopes, gains,
        jacobians, predicted,
    )  # fmt: skip
    return jacobians
