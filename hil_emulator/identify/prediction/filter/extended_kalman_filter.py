"""Extended Kalman filter, which computes the gains."""

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
    """Covariance of z, and memory for one update.

    Attributes:
        cov: covariance of z.
        present: mask of present readings.
        slope_present: memory for the derivative of the present readings by z.
        spread: memory of the same shape.
        innovation: covariance S of the innovations.
        before: memory for products of covariances.
        work: memory for products of covariances.
        gain: Kalman gain of the sample.
        whitening: L with S^-1 = L L^T.

    """

    cov: Array
    present: Mask
    slope_present: Array
    spread: Array
    innovation: Array
    before: Array
    work: Array
    gain: Array
    whitening: Array


def estimate_of(covariance: Array, chosen: int) -> Estimate:
    """Return the estimate at the start of a filter."""
    n, m = len(covariance), chosen
    return Estimate(
        covariance.copy(), np.ones(m, np.bool_), np.zeros((m, n)), np.zeros((m, n)),
        np.zeros((m, m)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, m)), np.zeros((m, m)),
    )  # fmt: skip


def update(estimate: Estimate, slope: Array, noise: Array, considered: int) -> None:
    """Update the covariance by a measurement, and store its gain and whitening.

    Args:
        estimate: updated in place.
        slope: derivative of the readings by z.
        noise: variance of each reading.
        considered: index of an element of z that is uncertain but not corrected (a consider state,
            Schmidt); -1 without such an element.

    """
    cov, present, h, hp = estimate.cov, estimate.present, estimate.slope_present, estimate.spread
    s, (m, n) = estimate.innovation, slope.shape
    gain, whitening = estimate.gain, estimate.whitening
    for i in range(m):
        for j in range(n):
            h[i, j] = slope[i, j] if present[i] else 0.0
    congruence(h, cov, hp, s)
    for i in range(m):
        s[i, i] += noise[i]
    root_of_inverse(s, whitening)
    # S^-1 = L L^T: the covariance is reduced by (L^T H P)^T (L^T H P)
    multiply(whitening.T, hp, h)
    multiply(h.T, whitening.T, gain)
    for a in range(n):
        for b in range(a + 1):
            reduction = 0.0
            for i in range(m):
                reduction += h[i, a] * h[i, b]
            if a != considered or b != considered:
                cov[a, b] -= reduction
                cov[b, a] = cov[a, b]
    if considered >= 0:
        for i in range(m):
            gain[considered, i] = 0.0


def spread(
    estimate: Estimate, onward: Array, tuning: Tuning, unknown: float, settling: bool
) -> None:
    """Propagate the covariance to the next sample.

    Args:
        estimate: propagated in place.
        onward: derivative of the next z by z.
        tuning: process noise.
        unknown: variance of the mean current over the period.
        settling: whether the spool is as uncertain as at the start.

    """
    cov, before = estimate.cov, estimate.before
    n, drift = len(cov), len(cov) - 2
    duplicate(cov, before)
    congruence(onward, before, estimate.work, cov)
    for i in range(n):
        cov[i, i] += tuning.diffusion[i]
    # an error of the current acts like the null drift, but only in this period
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
    """Run the filter along a recording; arguments and results as for `linearise`.

    The gains are computed if `predicted` has rows; otherwise the given gains correct the model.
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
    """Update the estimate by the readings of a sample."""
    set_secant(slopes, estimate, tuning)
    for i in range(len(data.chosen)):
        estimate.present[i] = np.isfinite(data.measured[k, i])
    considered = len(estimate.cov) - 2 if data.settling[k] else -1
    update(estimate, slopes.readings, noise, considered)


def set_secant(slopes: Slopes, estimate: Estimate, tuning: Tuning) -> None:
    """Set the width of the velocity's secant to its standard deviation, within bounds."""
    deviation = np.sqrt(max(estimate.cov[slopes.speed, slopes.speed], 0.0))
    slopes.secant[0] = min(max(tuning.secant[0], deviation), tuning.secant[1])


def linearise(
    model: ParametrisedModel, data: Data, start: Start, tuning: Tuning, noise: Array,
    gains: Gains, predicted: Array, probes: Index,
) -> Jacobians:  # fmt: skip
    """Run the extended Kalman filter, with Jacobians as of `elapse_linearly`.

    Arguments as in `innovations.predict`, and:
        tuning: initial covariance and process noise. The spool stays uncertain while the content
            of a dead time at the start of the recording is unknown. Excluded samples do not
            correct the null drift.
        noise: variance of each chosen channel.
        gains: overwritten if `predicted` has rows.
        predicted: receives the predicted z of each sample, shape (samples, z). Without rows, the
            run is repeated with the given gains.
        probes: parameters of the Jacobians; empty for z.

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
