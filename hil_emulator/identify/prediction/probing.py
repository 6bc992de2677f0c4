"""What a small term in a balance does to the innovations: along the base trajectory, linearly."""

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index
from hil_emulator.identify.prediction.records import (
    Data,
    Entries,
    Gains,
    Jacobians,
    ParametrisedModel,
    Start,
)
from hil_emulator.identify.prediction.run import (
    Sense,
    begin,
    beside,
    correct,
    elapse,
    follow,
    install,
)


def probe(
    sense: Sense, model: ParametrisedModel, data: Data, start: Start, gains: Gains,
    probes: Index, sizes: Array,
) -> Entries:  # fmt: skip
    """Run the frozen predictor and derive each of its steps by the probes.

    Arguments as in `filter.predict`, and:
        probes: parameters whose effect on the next state is wanted.
        sizes: step of their differences.

    """
    current, measured, chosen, sources = data.current, data.measured, data.chosen, model.sources
    count, n, m = len(current), len(start.z), len(chosen)
    entries = Entries(
        np.zeros((count, n, len(probes)), np.float32), np.zeros((count, m, len(probes)), np.float32)
    )
    run = begin(model, start, current[0])
    instruments = install(model, run.signals, run.path, data.period)
    corrected, moved = beside(run), beside(run)
    z, par = run.z, run.par
    error = np.zeros(m)
    for k in range(count):
        sense(*instruments)
        for i in range(m):
            error[i] = measured[k, i] - instruments.reading[chosen[i]]
            if not np.isfinite(measured[k, i]):
                error[i] = 0.0
        correct(run, instruments, gains.kalman[k], error)
        follow(corrected, run)
        elapse(run, current[k], model.steps)
        for j in range(len(probes)):
            follow(moved, corrected)
            # both runs have the same parameters
            par[probes[j]] += sizes[j]
            elapse(moved, current[k], model.steps)
            par[probes[j]] -= sizes[j]
            for i in range(n):
                entries.drives[k, i, j] = (moved.z[i] - z[i]) / sizes[j]
            for i in range(m):
                source = sources[chosen[i]]
                entries.feeds[k, i, j] = (moved.signals[source] - run.signals[source]) / sizes[j]
    return entries


def propagate(
    gains: Gains, jacobians: Jacobians, entry: Entries, inputs: Array, outputs: Array,
    columns: Array,
) -> None:  # fmt: skip
    """Fill a residual's derivatives by small terms that act along the base trajectory.

    All of them at once: a processor multiplies several numbers by one as fast as a single one.

    Args:
        gains: the frozen gains.
        jacobians: along the base trajectory.
        entry: where the terms enter.
        inputs: what each adds there, shape (samples, terms); without rows, nothing.
        outputs: what each adds to the readings, shape (samples, chosen, terms); without rows,
            nothing.
        columns: derivatives of the whitened innovations, shape (terms, samples, chosen);
            overwritten.

    """
    kalman, whitening = gains.kalman, gains.whitening
    maps, senses = jacobians.maps, jacobians.senses
    drives, feeds = entry.drives, entry.feeds
    n, m, terms = kalman.shape[1], kalman.shape[2], columns.shape[0]
    dz, after, dy = np.zeros((n, terms)), np.zeros((n, terms)), np.zeros((m, terms))
    for k in range(columns.shape[1]):
        if len(outputs) > 0:
            for i in range(m):
                for t in range(terms):
                    dy[i, t] += outputs[k, i, t]
        for i in range(m):
            for t in range(terms):
                columns[t, k, i] = 0.0
            for j in range(m):
                for t in range(terms):
                    columns[t, k, i] -= whitening[k, j, i] * dy[j, t]
        for i in range(n):
            for j in range(m):
                for t in range(terms):
                    dz[i, t] -= kalman[k, i, j] * dy[j, t]
        after[:, :] = 0.0
        dy[:, :] = 0.0
        for i in range(n):
            for j in range(n):
                for t in range(terms):
                    after[i, t] += maps[k, i, j] * dz[j, t]
        for i in range(m):
            for j in range(n):
                for t in range(terms):
                    dy[i, t] += senses[k, i, j] * dz[j, t]
        if len(inputs) > 0:
            for t in range(terms):
                for i in range(n):
                    after[i, t] += drives[k, i] * inputs[k, t]
                for i in range(m):
                    dy[i, t] += feeds[k, i] * inputs[k, t]
        dz[:, :] = after
