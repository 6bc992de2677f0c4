"""Errors of a free run: the model without corrections between restarts, compiled."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array
from hil_emulator.identify.prediction.model_run.records import (
    Data,
    Errors,
    Gains,
    Jacobians,
    ParametrisedModel,
    Restarts,
    Start,
)
from hil_emulator.identify.prediction.model_run.run import (
    begin,
    correct,
    elapse,
    follow,
    install,
    second_run,
)
from hil_emulator.identify.prediction.model_run.small_matrices import congruence, copy, multiply


def run_freely(
    model: ParametrisedModel, data: Data, start: Start, gains: Gains, restarts: Restarts
) -> Errors:
    """Run the frozen predictor together with a free run that restarts from its state.

    Arguments as in `innovations.predict`, and:
        restarts: samples of the restarts.

    """
    current, measured, chosen = data.current, data.measured, data.chosen
    kalman, first = gains.kalman, restarts.first
    errors = Errors(
        np.full(measured.shape, np.nan), np.full(measured.shape, np.nan),
        np.empty((len(measured), model.signals)),
    )  # fmt: skip
    one, free = errors.one, errors.free
    run = begin(model, start, current[0])
    instruments = install(model, run.signals, run.path, data.period)
    loose = second_run(run)
    loose_instruments = install(model, loose.signals, loose.path, data.period)
    error = np.zeros(len(chosen))
    for k in range(len(current)):
        if k > first:
            model.sense(*loose_instruments)
            for i in range(len(chosen)):
                free[k, i] = measured[k, i] - loose_instruments.reading[chosen[i]]
        model.sense(*instruments)
        copy(run.signals, errors.track[k])
        for i in range(len(chosen)):
            one[k, i] = measured[k, i] - instruments.reading[chosen[i]]
            error[i] = one[k, i] if np.isfinite(measured[k, i]) else 0.0
        correct(run, instruments, kalman[k], error)
        if k >= first and (k - first) % restarts.window == 0:
            follow(loose, run)
            copy(run.signals, loose.signals)
            copy(instruments.trace, loose_instruments.trace)
            copy(instruments.history, loose_instruments.history)
        elapse(run, current[k], model.steps)
        if k >= first:
            elapse(loose, current[k], model.steps)
    return errors


def carry(
    gains: Gains, jacobians: Jacobians, noise: Array, unknown: Array, diffusion: Array,
    restarts: Restarts, one: Array, free: Array,
) -> None:  # fmt: skip
    """Propagate the error covariances of the predictor and of the free run, by source.

    Args:
        gains: the frozen gains.
        jacobians: along the predictor's trajectory.
        noise: variance of each channel.
        unknown: variance of the mean current over each period, part of the first source.
        diffusion: process noise of each further source per sample, shape (sources - 1, z).
        restarts: of the free run.
        one: receives the variance of the reading's error, shape (sources, samples, channels).
        free: receives the same for the free run.

    """
    kalman, maps, senses = gains.kalman, jacobians.maps, jacobians.senses
    count, n, m = kalman.shape
    drift = n - 2
    cov, loose = np.zeros((len(one), n, n)), np.zeros((len(one), n, n))
    kept, pushed = np.zeros((n, n)), np.zeros(n)
    product, work, before = np.zeros((m, n)), np.zeros((n, n)), np.zeros((n, n))
    for k in range(count - 1):
        if k >= restarts.first and (k - restarts.first) % restarts.window == 0:
            copy(cov.ravel(), loose.ravel())
        multiply(kalman[k + 1], senses[k], kept)
        for i in range(n):
            for j in range(n):
                kept[i, j] = maps[k, i, j] - kept[i, j]
        for s in range(len(one)):
            if s > 0:
                for i in range(n):
                    cov[s, i, i] += diffusion[s - 1, i]
                    loose[s, i, i] += diffusion[s - 1, i]
            show(senses[k], cov[s], product, one[s, k + 1])
            show(senses[k], loose[s], product, free[s, k + 1])
            copy(cov[s].ravel(), before.ravel())
            congruence(kept, before, work, cov[s])
            copy(loose[s].ravel(), before.ravel())
            congruence(maps[k], before, work, loose[s])
        for c in range(m):
            variance = noise[c] + unknown[k] * senses[k, c, drift] ** 2
            one[0, k + 1, c] += variance
            free[0, k + 1, c] += variance
        for i in range(n):
            pushed[i] = maps[k, i, drift] if i < drift else 0.0
        widen(loose[0], pushed, unknown[k])
        for i in range(n):
            for c in range(m):
                pushed[i] -= kalman[k + 1, i, c] * senses[k, c, drift]
        widen(cov[0], pushed, unknown[k])
        for c in range(m):
            for i in range(n):
                pushed[i] = kalman[k + 1, i, c]
            widen(cov[0], pushed, noise[c])


def show(senses: Array, cov: Array, product: Array, variance: Array) -> None:
    """Compute the variance of each channel for a covariance of z; `product` is memory."""
    multiply(senses, cov, product)
    for c in range(senses.shape[0]):
        variance[c] = 0.0
        for i in range(senses.shape[1]):
            variance[c] += product[c, i] * senses[c, i]


def widen(cov: Array, direction: Array, variance: float) -> None:
    """Add a variance along one direction to a covariance."""
    for i in range(len(cov)):
        for j in range(len(cov)):
            cov[i, j] += variance * direction[i] * direction[j]
