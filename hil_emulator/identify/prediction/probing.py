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
    Tick,
    begin,
    beside,
    elapse,
    follow,
    install,
)


def probe(
    tick: Tick, sense: Sense, model: ParametrisedModel, data: Data, start: Start, gains: Gains,
    probes: Index, sizes: Array,
) -> Entries:  # fmt: skip
    """Run the frozen predictor and derive each of its steps by the probes.

    Arguments as in `filter.predict`, and:
        probes: parameters whose effect on the next state is wanted.
        sizes: step of their differences.

    """
    current, measured, chosen, sources = data.current, data.measured, data.chosen, model.sources
    count, n, m = len(current), len(start.z), len(chosen)
    entries = Entries(np.zeros((count, n, len(probes))), np.zeros((count, m, len(probes))))
    run = begin(tick, model, start, current[0])
    instruments = install(model, run.signals, run.path, data.period)
    corrected, moved = beside(run), beside(run)
    z, par = run.z, run.par
    for k in range(count):
        sense(*instruments)
        for j in range(m):
            error = measured[k, j] - instruments.reading[chosen[j]]
            if np.isfinite(error):
                for i in range(n):
                    z[i] += gains.kalman[k, i, j] * error
        follow(corrected, run)
        elapse(tick, run, current[k], model.steps)
        for j in range(len(probes)):
            follow(moved, corrected)
            # both runs have the same parameters
            par[probes[j]] += sizes[j]
            elapse(tick, moved, current[k], model.steps)
            par[probes[j]] -= sizes[j]
            for i in range(n):
                entries.drives[k, i, j] = (moved.z[i] - z[i]) / sizes[j]
            for i in range(m):
                source = sources[chosen[i]]
                entries.feeds[k, i, j] = (moved.signals[source] - run.signals[source]) / sizes[j]
    return entries


def propagate(
    gains: Gains, jacobians: Jacobians, entries: Entries, inputs: Array, outputs: Array,
    column: Array,
) -> None:  # fmt: skip
    """Fill a residual's derivative by a small term that acts along the base trajectory.

    Args:
        gains: the frozen gains.
        jacobians: along the base trajectory.
        entries: where the term can enter.
        inputs: what the term adds to each entry, shape (samples, entries).
        outputs: what it adds to each reading, shape (samples, chosen).
        column: derivative of the whitened innovations, shape (samples, chosen); overwritten.

    """
    kalman, whitening, maps, senses = (
        gains.kalman,
        gains.whitening,
        jacobians.maps,
        jacobians.senses,
    )
    drives, feeds = entries.drives, entries.feeds
    n, m = kalman.shape[1], kalman.shape[2]
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
                dz[i] -= kalman[k, i, j] * dy[j]
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
